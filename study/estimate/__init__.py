"""``stickslip estimate``: first values of contact and damping parameters, straight from measurements."""
