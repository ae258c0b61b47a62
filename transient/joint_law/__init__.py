"""Forces of joint laws over one time step, one file per law: an independent check of `hbsolve.joint_law`."""
