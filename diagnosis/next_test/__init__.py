"""The next test: which further measurement separates explanations that the data cannot tell apart."""
