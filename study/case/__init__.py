"""The case file: one structure and all that is done with it, and the model that it describes."""
