"""``stickslip compare``: a model compared with measurements."""
