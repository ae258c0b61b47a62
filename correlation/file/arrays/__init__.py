"""Arrays, structures and references of MATLAB and HDF5 files as columns."""
