"""What measured signals say, as pure functions: harmonics, frequency responses, ring-downs, friction loops."""
