"""Craig-Bampton reduction: basis, reduced model, recovery, file and error estimate. Knows nothing of contact laws."""
