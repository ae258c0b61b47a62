"""Model against measurement: measured data, sensors, predictions, metrics, discrepancies."""
