"""Parametric solids of the rig: named faces, contact lines, STEP. No meshes."""
