"""Joint laws, one file each: rows, parameters, and what else must be known of a law. Its forces: `hbsolve.contact`."""
