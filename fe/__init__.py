"""Meshes, elements, sparse mass and stiffness, supports and modes. Knows nothing of reduction or contact."""
