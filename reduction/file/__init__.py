"""Files of reduced models and of structure matrices."""
