"""``stickslip estimate``: first values of contact stiffness, friction, preload and damping from a campaign."""
