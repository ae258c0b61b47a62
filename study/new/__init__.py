"""`stickslip new`: a first case file that loads and solves at once."""
