"""Files of other programs: meshes and sparse matrices in and out, with the names of their parts."""
