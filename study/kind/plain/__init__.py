"""Plain matrices in a file."""
