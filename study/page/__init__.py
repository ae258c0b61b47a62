"""Pages that hold everything and load nothing: what those of all commands have in common."""
