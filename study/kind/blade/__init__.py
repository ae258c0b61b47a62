"""One blade, clamped at its root."""
