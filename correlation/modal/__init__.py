"""Modes from measured frequency responses, and comparison of modes: poles, shapes, assurance, pairing, linearity."""
