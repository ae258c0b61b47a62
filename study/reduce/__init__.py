"""``stickslip reduce``: comparison and report for all kinds of structures."""
