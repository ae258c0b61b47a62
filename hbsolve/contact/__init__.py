"""Contact laws: what a joint answers to a periodic motion."""
