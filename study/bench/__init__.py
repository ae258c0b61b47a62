"""`stickslip bench`: a case and measurements in the browser; add or undo effects, calibrate, change parameters."""
