"""``stickslip sweep``: response curves and limits over a grid of parameters."""
