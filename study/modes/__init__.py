"""``stickslip modes``: natural frequencies and mode shapes."""
