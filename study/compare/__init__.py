"""``stickslip compare``: a model beside measurements."""
