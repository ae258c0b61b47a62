"""The recovered law at a place, and the laws of all places with their probabilities."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from diagnosis.candidate.place import PlaceUnits
from diagnosis.fit.fit_parameter import Values
from diagnosis.missing_law.basis import LawBasis
from diagnosis.missing_law.evidence import Posterior
from diagnosis.missing_law.loaded_states import StateTable

Row = Float[NDArray[np.float64], " r"]
Motion = Complex[NDArray[np.complex128], "s h"]

#: Total probability of the places of a credible set [-].
CREDIBLE = 0.95


@dataclass(frozen=True, kw_only=True, eq=False)
class PlaceLaw:
    """The most probable law at a place.

    Parameters
    ----------
    name, row
        Place, and its row over the degrees of freedom, shape (r,) [-].
    basis
        Basis functions of the law.
    units
        Units at the place; the units below are those for a displacement.
    posterior
        Posterior of the coefficients [N].
    motion
        Harmonics of the displacement of the place in each state, shape (s, h) [m].
    loads
        Harmonics of the force of the law on the structure, shape (s, h) [N].
    drive
        The same, with the fundamental estimated from the measured readings, shape (s, h) [N].
    table
        The states.
    values
        Calibration parameters and previously added effects, shape (p,).
    evidence
        ln of the density of the data with the law, less that without it [-].
    """

    name: str
    row: Row
    basis: LawBasis
    units: PlaceUnits
    posterior: Posterior
    motion: Motion
    loads: Motion
    drive: Motion
    table: StateTable
    values: Values
    evidence: float

    @property
    def angular_frequency(self) -> Float[NDArray[np.float64], " s"]:
        """Angular frequency of each state, shape (s,) [rad/s]."""
        return self.table.angular_frequency


@dataclass(frozen=True, kw_only=True, eq=False)
class MissingLaw:
    """Result of a recovery.

    Parameters
    ----------
    places
        The law of each place, the most probable place first.
    probability
        Probability of each place, given that one law acts at one place, shape (p,) [-].
    credible
        Names of the most probable places with a total probability of at least 95 %.
    """

    places: tuple[PlaceLaw, ...]
    probability: Float[NDArray[np.float64], " p"]
    credible: tuple[str, ...]

    @property
    def best(self) -> PlaceLaw:
        """The law at the most probable place."""
        return self.places[0]


def rank_laws(laws: Sequence[PlaceLaw]) -> MissingLaw:
    """Laws of all places with their probabilities, the most probable first."""
    ordered = sorted(laws, key=lambda law: -law.evidence)
    evidence = np.array([law.evidence for law in ordered])
    probability = np.exp(evidence - evidence[0])
    probability /= probability.sum()
    count = int(np.searchsorted(np.cumsum(probability), CREDIBLE)) + 1
    return MissingLaw(
        places=tuple(ordered), probability=probability, credible=tuple(law.name for law in ordered[:count])
    )
