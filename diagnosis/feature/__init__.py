"""Diagnosis of data that are compared by features: ring-downs, loops, modes, frequency responses."""
