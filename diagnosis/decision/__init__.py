"""From refits to a verdict."""
