"""``stickslip solve``: response curves."""
