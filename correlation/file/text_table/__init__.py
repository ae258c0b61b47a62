"""Tables of text: separators, decimal signs, headers and rows."""
