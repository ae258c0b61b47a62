"""A part of the user's own, from a STEP or a mesh file."""
