"""Unknown force at a place, if no known effect explains the data: a force of the motion, or a resonator."""

from typing import TypeAlias

from diagnosis.fit.arrangement import Arrangement
from diagnosis.localisation import UnknownForcePlace, localise
from diagnosis.model_error_share import list_covariances
from diagnosis.resonator import Resonator, find_resonators

UnknownForce: TypeAlias = UnknownForcePlace | Resonator


def find_unknown_forces(arrangement: Arrangement) -> list[UnknownForce]:
    """Unknown forces that would explain the residual, ranked by the gain less the number of their parameters."""
    weights = list_covariances(arrangement)
    return sorted(
        [*localise(arrangement, weights), *find_resonators(arrangement, weights)], key=compute_excess_gain, reverse=True
    )


def compute_excess_gain(force: UnknownForce) -> float:
    """Gain of an unknown force less the number of its parameters [-]."""
    return force.gain - force.n_number
