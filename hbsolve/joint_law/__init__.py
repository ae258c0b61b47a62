"""Forces of joint laws in a periodic motion, one file per law, with their derivatives."""
