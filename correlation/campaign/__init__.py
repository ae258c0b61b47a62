"""Measured campaigns: data types, the files they are read from and written to, units."""
