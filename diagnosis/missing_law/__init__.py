"""The missing law: one force law of displacement, velocity and history that explains what a model lacks at a place."""
