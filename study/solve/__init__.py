"""``stickslip solve``: response curves of structures with joints."""
