"""`stickslip bench`: case and measurements in the browser, to see, add, undo, calibrate and move parameters."""
