"""Families of measured curves, and comparison with the limits that friction history allows."""
