"""Craig-Bampton reduction: basis, reduced model, recovery, file and error estimate. Joint laws are data here."""
