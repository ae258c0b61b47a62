"""Uncertain parameters: their distributions, draws from them, and variance-based indices."""
