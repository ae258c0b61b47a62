"""Figures: results and arrays in, PNG, GIF or MP4 out."""
