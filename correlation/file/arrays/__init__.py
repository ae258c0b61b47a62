"""Conversion of arrays, structures and references of MATLAB and HDF5 files to columns."""
