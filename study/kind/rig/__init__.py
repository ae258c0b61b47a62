"""The whole rig: blade, dampers and de-couplers."""
