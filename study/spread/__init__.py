"""``stickslip spread``: spread of response and limits over distributions of uncertain parameters."""
