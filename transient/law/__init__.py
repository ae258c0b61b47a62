"""Forces of joints over one step, one law each: the independent witness of `hbsolve.contact`."""
