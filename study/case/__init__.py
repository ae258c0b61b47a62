"""Case files: their tables, and the model that they describe."""
