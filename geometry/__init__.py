"""Parametric solids of the rig: named faces, contact lines, STEP. Knows nothing of meshes."""
