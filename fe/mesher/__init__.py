"""Meshers: mapped hexahedra of the bodies of the rig, tetrahedra in any CAD solid."""
