"""The calibration of the paper, replayed: its tables and figures 12 to 23 on a virtual rig."""
