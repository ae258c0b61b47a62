"""Universal files (UFF, UNV): the container, its datasets 15, 55, 58, 58b, 151, 164 and 2411, and a writer."""
