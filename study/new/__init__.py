"""`stickslip new`: a first case file that can be solved without changes."""
