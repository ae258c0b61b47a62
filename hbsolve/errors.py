"""What can be wrong with a force, a dynamic model or a search for a peak; the tree is drawn in `geometry.errors`."""

from geometry.errors import InputError, InputWarning


class ForceError(InputError):
    """An excitation that the model cannot answer."""


class ModelError(InputError):
    """Mass, damping and stiffness that describe no vibrating structure."""


class PeakError(InputError):
    """A band or a set of samples that holds no resonance peak."""


class BalanceError(InputError):
    """Harmonics, samples, a start or a parameter that the harmonic balance cannot use."""


class DampingWarning(InputWarning):
    """Damping that puts energy into some motion."""
