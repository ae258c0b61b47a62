"""Universal files (UFF, UNV): container, datasets 15, 55, 58, 58b, 151, 164 and 2411, and a writer."""
