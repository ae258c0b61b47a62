"""Limits of all sensors of motion and of the forces of all contact lines in one run."""
