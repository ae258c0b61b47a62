"""A point mass: a sensor, its cable, or the moving part of a shaker."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.place import find_moving_places, find_translations
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "mass"
LARGEST = 100.0


@dataclass(frozen=True, kw_only=True, eq=False)
class PointMass:
    """A mass that moves along rows, shape (t, r) [-]; a negative value removes mass."""

    name: str
    rows: Float[NDArray[np.float64], "t r"]
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = "A point mass moves with this place: a sensor, its cable, or the armature of a shaker."
    signature: str = (
        "Resonance frequencies fall by the same share at all levels, more so at high frequencies; the missing force is "
        "in phase with the displacement (0 deg), proportional to it (exponent 1), without higher harmonics."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """M + m sum b^T b."""
        (mass,) = values
        return model.with_system(mass=model.system.mass + mass * self.rows.T @ self.rows)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """A mass at each place: on all translations of its node, or along the place's row if the node is unknown."""
    size = size or measure_scale(model)
    places, left = find_moving_places(model, size, KIND)
    result: list[Effect | Untestable] = []
    taken: dict[tuple[int, ...], str] = {}
    for place in places:
        name = f"{KIND} at {place.name}"
        moved = find_translations(model, place.row)
        if moved in taken:
            result.append(Untestable(name=name, reason=f'it is the mass at "{taken[moved]}": one node'))
            continue
        if moved:
            taken[moved] = place.name
        rows = np.eye(len(place.row))[list(moved)] if moved else place.row[None]
        typical = size.point_mass(rows)
        if typical is None:
            result.append(Untestable(name=name, reason="no mass there can lower the first resonance by 0.5 %"))
            continue
        lower, upper = -min(size.removable_mass(rows), LARGEST * typical), LARGEST * typical
        unit = place.unit("kg", "kg m^2")
        parameter = EffectParameter(name="mass", unit=unit, lower=lower, upper=upper, typical=typical)
        result.append(PointMass(name=name, rows=rows, parameters=(parameter,)))
    return [*result, *left]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="places that move", physics=PointMass.physics, signature=PointMass.signature,
        parameters={"mass": ("kg", "kg m^2")}, candidates=candidates, order=2,
        is_addition=True,
    )
)  # fmt: skip
