"""Measured campaigns: their data classes, reading and writing of their files, and units."""
