"""Mass and stiffness that another program wrote."""
