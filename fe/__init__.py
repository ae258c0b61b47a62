"""Meshes, elements, sparse mass and stiffness, supports and modes. No reduction or contact."""
