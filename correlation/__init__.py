"""Model beside measurement: campaigns, features, noise, predictions, metrics."""
