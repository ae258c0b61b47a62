"""Modes from measured frequency responses, and modes beside modes: poles, shapes, assurance, pairing, linearity."""
