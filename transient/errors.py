"""Errors of the input of a time integration."""

from geometry.errors import InputError


class TransientError(InputError):
    """A system, a state or a step that cannot be integrated in time."""


class StepError(TransientError):
    """Joint forces that were not found within a step: it is too long for the contacts."""
