"""Drag of the surrounding air."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.place import find_moving_places, with_quadratic_damper
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "air damping"
#: Largest over typical strength. The latter is for the stuck structure; friction may keep speeds far below it.
LARGEST = 1e4


@dataclass(frozen=True, kw_only=True, eq=False)
class AirDamping:
    """f = d |du/dt| du/dt along a row, shape (r,) [-]."""

    name: str
    row: Float[NDArray[np.float64], " r"]
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = "The surrounding air drags at this place with the square of the velocity."
    signature: str = (
        "The damping ratio rises with the amplitude at constant frequencies; a weak third harmonic appears; the "
        "missing force opposes the velocity (-90 deg to the displacement) with exponent 2; also without contacts."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Add a damper, also where its damping is zero."""
        (damping,) = values
        return with_quadratic_damper(model, self.name, self.row, damping)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    r"""Drag at each place, typically 8/(3 pi) d omega a of a dashpot with a tenth of the modal damping."""
    size = size or measure_scale(model)
    places, left = find_moving_places(model, size, KIND)
    result: list[Effect | Untestable] = []
    for place in places:
        name, typical = f"{KIND} at {place.name}", size.drag(place.row)
        if typical is None:
            result.append(Untestable(name=name, reason="the model has no harmonic force that would move it"))
            continue
        upper, unit = LARGEST * typical, place.unit("N s^2/m^2", "N m s^2")
        parameter = EffectParameter(name="damping", unit=unit, lower=0.0, upper=upper, typical=typical)
        result.append(AirDamping(name=name, row=place.row, parameters=(parameter,)))
    return [*result, *left]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="places that move", physics=AirDamping.physics, signature=AirDamping.signature,
        parameters={"damping": ("N s^2/m^2", "N m s^2")}, candidates=candidates, order=5,
    )
)  # fmt: skip
