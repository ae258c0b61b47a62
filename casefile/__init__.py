"""Case files: TOML with units in the values, and mistakes reported with file, line and key."""
