"""A linear spring: a stinger, a cable or a support; or between two bodies."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.place import Place, find_dof, find_moving_places
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "spring"
#: Largest over typical strength.
LARGEST = 100.0
#: Least relative motion of a place: a support hardly moves, but its stiffness is significant.
SUPPORT = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearSpring:
    """f = k u along a row, shape (r,) [-]; a negative value removes stiffness."""

    name: str
    row: Float[NDArray[np.float64], " r"]
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = "A linear spring acts at this place: a stinger, a cable, or a support that differs from the model."
    signature: str = (
        "Resonance frequencies rise by the same share at all levels, with and without contacts; the missing force "
        "opposes the displacement (180 deg) and is proportional to it (exponent 1), without higher harmonics."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """K + k b^T b."""
        (stiffness,) = values
        return model.with_system(stiffness=model.system.stiffness + stiffness * np.outer(self.row, self.row))


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """A spring to the ground at each place, and between places of two bodies that move in one direction."""
    size = size or measure_scale(model)
    places, left = find_moving_places(model, size, KIND, least=SUPPORT)
    result: list[Effect | Untestable] = [_make_candidate(f"{KIND} at {item.name}", item, size) for item in places]
    for one, other in combinations(places, 2):
        first, second = find_dof(model, one.row), find_dof(model, other.row)
        if first and second and first.body != second.body and first.direction == second.direction:
            gap = Place(name="", row=_unsigned(one.row) - _unsigned(other.row), rotational=one.rotational)
            result.append(_make_candidate(f"{KIND} between {one.name} and {other.name}", gap, size))
    return [*result, *left]


def _unsigned(row: Float[NDArray[np.float64], " r"]) -> Float[NDArray[np.float64], " r"]:
    return np.abs(row)  # of a single degree of freedom, along its own direction


def _make_candidate(name: str, place: Place, size: Scale) -> Effect | Untestable:
    typical = size.spring(place.row)
    if typical is None:
        return Untestable(name=name, reason="no stiffness there can shift the first resonance by 0.5 %")
    parameter = EffectParameter(
        name="stiffness",
        unit=place.unit("N/m", "N m"),
        lower=-min(size.removable_stiffness(place.row), LARGEST * abs(typical)),
        upper=LARGEST * abs(typical),
        typical=typical,
    )
    return LinearSpring(name=name, row=place.row, parameters=(parameter,))


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="places that move, and pairs of bodies", physics=LinearSpring.physics,
        signature=LinearSpring.signature,
        parameters={"stiffness": ("N/m", "N m")}, candidates=candidates, order=1,
        is_addition=True,
    )
)  # fmt: skip
