"""Families of measured curves over the limits that friction history allows."""
