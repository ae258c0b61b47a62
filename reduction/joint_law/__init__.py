"""Joint laws as data, one file per law: directions, parameters and all facts. Forces: `hbsolve.joint_law`."""
