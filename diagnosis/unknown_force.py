"""Unknown force at a place, where no known effect explains the data: one that grows with the motion, or a resonator."""

from typing import TypeAlias

from diagnosis.fit.arrangement import Arrangement
from diagnosis.localisation import UnknownForcePlace, localise
from diagnosis.model_error_share import list_covariances
from diagnosis.resonator import Resonator, find_resonators

UnknownForce: TypeAlias = UnknownForcePlace | Resonator


def find_unknown_forces(arrangement: Arrangement) -> list[UnknownForce]:
    """Unknown forces that would explain the residual, ranked by the gain beyond the number of their parameters."""
    weights = list_covariances(arrangement)
    return sorted(
        [*localise(arrangement, weights), *find_resonators(arrangement, weights)], key=compute_excess_gain, reverse=True
    )


def compute_excess_gain(force: UnknownForce) -> float:
    """Gain of an unknown force beyond the number of its parameters [-]."""
    return force.gain - force.n_number
