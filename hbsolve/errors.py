"""Errors of a force, a dynamic model or a search for a peak; the tree is drawn in `geometry.errors`."""

from enum import Enum

from geometry.errors import InputError, InputWarning


class ForceError(InputError):
    """An excitation to which the model has no response."""


class ModelError(InputError):
    """Mass, damping and stiffness that describe no vibrating structure."""


class NoPeakError(InputError):
    """A band or a set of samples without a resonance peak."""


class BalanceError(InputError):
    """Harmonics, samples, a start or a parameter that the harmonic balance cannot use."""


class DampingWarning(InputWarning):
    """Damping that adds energy to some motion."""


class Failure(Enum):
    """Reason why no steady state was found; the value is advice."""

    NEWTON = "start from a neighbouring state, or continue a branch to here"
    DRIFT = "hold the body by a support or a spring, or give a load without a mean"
    MEMORY = "give a law whose state fades or repeats, or a smaller load"
    SLIDERS_UNSET = (
        "a steady state exists with the sliders at their positions under the static load: give `slider`, the "
        "`periodic_slider` of the state at level 0"
    )


class NoSteadyState(ArithmeticError):
    """No steady state was found; the message gives the place, the attempts and the next step.

    Parameters
    ----------
    message
        Place of the state, and the attempts.
    failure
        Reason; its advice ends the message.
    """

    def __init__(self, message: str, failure: Failure = Failure.NEWTON) -> None:
        super().__init__(message, failure)
        self.failure = failure

    def __str__(self) -> str:
        """Message with the advice."""
        return f"{self.args[0]}; {self.failure.value}"
