"""Which physical effect is missing: candidate effects, calibration, screening, ranking, verdicts."""
