"""``stickslip reduce``: what all kinds of structures share."""
