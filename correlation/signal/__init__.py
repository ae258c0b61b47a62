"""Analysis of measured signals, as pure functions: harmonics, frequency responses, ring-downs, friction loops."""
