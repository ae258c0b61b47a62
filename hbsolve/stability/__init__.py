"""Stability of steady states: Floquet multipliers, and where a branch gains or loses stability."""
