"""Diagnosis of data that are compared through features: ring-downs, loops, modes, frequency responses."""
