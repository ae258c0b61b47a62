"""Meshes made of shapes: mapped hexahedra of each body, tetrahedra in any CAD solid."""
