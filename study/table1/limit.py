"""The frequency that nested meshes tend to, and the order with which they do."""

from dataclasses import dataclass
from math import log

from geometry.errors import InputError
from pipeline.store import stage
from study.kind.blade.model import BladeModel, first_frequency

#: Orders below this share of theory's 2 p are far from it: a corner or the clamp's edge, not the element, decides.
FAR_FROM_THEORY = 0.75


@dataclass(frozen=True, kw_only=True)
class NestedPoint:
    """First frequency on one of the nested meshes [Hz], and its degrees of freedom [-]."""

    frequency: float
    n_dof: int


@dataclass(frozen=True, kw_only=True)
class Limit:
    """Richardson's extrapolation from three nested meshes.

    Parameters
    ----------
    frequency
        Extrapolated [Hz].
    order
        Observed exponent of the element size in the error [-].
    theory
        2 p: the exponent on a smooth solution [-].
    """

    frequency: float
    order: float
    theory: int

    @property
    def warning(self) -> str:
        """Why the limit is less sure than theory says; empty if it is not."""
        if self.order >= FAR_FROM_THEORY * self.theory:
            return ""
        return (
            f"The observed order {self.order:.2f} is far below {self.theory}, that of a smooth solution: the stress is "
            "singular at the re-entrant corner of the root and at the clamp's edge, and refinement everywhere hardly "
            "helps there. The limit is an estimate."
        )


@stage("mesh-study limit")
def nested_point(inputs: BladeModel) -> NestedPoint:
    """First frequency of one nested mesh."""
    _, frequency, n_dof = first_frequency(inputs)
    return NestedPoint(frequency=frequency, n_dof=n_dof)


def richardson(frequencies: list[float], ratio: float, degree: int) -> Limit:
    """Limit and observed order from three meshes, each `ratio` times finer than the last.

    Parameters
    ----------
    frequencies
        Coarse, medium, fine [Hz].
    ratio
        Of element sizes [-], above 1.
    degree
        Polynomial degree p of the element [-].

    Raises
    ------
    InputError
        The frequencies do not approach a limit: their differences do not shrink.

    References
    ----------
    Roache, Verification and Validation in Computational Science and Engineering (1998), ch. 5.
    """
    coarse, medium, fine = frequencies
    first, second = coarse - medium, medium - fine
    if not first * second > 0 or abs(first) <= abs(second):
        raise InputError(
            f"frequencies {coarse:.6g}, {medium:.6g}, {fine:.6g} Hz of the nested meshes show no limit: "
            "start from a finer mesh"
        )
    order = log(first / second) / log(ratio)
    return Limit(frequency=fine - second / (ratio**order - 1), order=order, theory=2 * degree)
