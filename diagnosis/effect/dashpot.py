"""A viscous dashpot: a cable, a shaker's coil, an oil film."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.place import find_moving_places
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "dashpot"
LARGEST = 100.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Dashpot:
    """f = c du/dt along a row, shape (r,) [-]."""

    name: str
    row: Float[NDArray[np.float64], " r"]
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = "A viscous damper to the ground acts at this place: a cable, the coil of a shaker, an oil film."
    signature: str = (
        "Damping rises by the same amount at all levels; the missing force opposes the velocity (-90 deg to the "
        "displacement) and is proportional to it (exponent 1), without higher harmonics."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """C + c b^T b."""
        (damping,) = values
        return model.with_system(damping=model.system.damping + damping * np.outer(self.row, self.row))


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """A dashpot at each place, typically with a tenth of the modal damping."""
    size = size or measure_scale(model)
    places, left = find_moving_places(model, size, KIND)
    result: list[Effect | Untestable] = []
    for place in places:
        typical, unit = size.dashpot(place.row), place.unit("N s/m", "N m s")
        parameter = EffectParameter(name="damping", unit=unit, lower=0.0, upper=LARGEST * typical, typical=typical)
        result.append(Dashpot(name=f"{KIND} at {place.name}", row=place.row, parameters=(parameter,)))
    return [*result, *left]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="places that move", physics=Dashpot.physics, signature=Dashpot.signature,
        parameters={"damping": ("N s/m", "N m s")}, candidates=candidates, order=6,
    )
)  # fmt: skip
