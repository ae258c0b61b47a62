"""A cubic spring: membrane stretching, a hardening or softening support."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.force_law import ForceLaw, make_clearance_laws, make_even_laws, make_power_law
from diagnosis.candidate.place import find_moving_places, with_cubic_spring
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind
from hbsolve.state import SteadyState
from reduction.stuck import stuck_stiffness

KIND = "cubic"
#: Bounds over typical strength: with strong softening the motion becomes unstable, and friction may keep amplitudes far
#: below those of the stuck structure, which determine the typical strength.
SOFTEST, LARGEST = 20.0, 1e5


@dataclass(frozen=True, kw_only=True, eq=False)
class Cubic:
    """f = k u^3 along a row, shape (r,) [-]."""

    name: str
    row: Float[NDArray[np.float64], " r"]
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = (
        "A spring to the ground hardens (softens, if negative): its force grows with the cube of the displacement."
    )
    signature: str = (
        "Resonance frequencies rise with the square of the amplitude, most at the highest level; a third harmonic "
        "appears; the missing force opposes the displacement (180 deg) with exponent 3; also without contacts."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Add a cubic spring, also where its stiffness is zero."""
        (stiffness,) = values
        return with_cubic_spring(model, self.name, self.row, stiffness)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    r"""A cubic spring at each place, typically 3/4 k a^2 of a spring that shifts the resonance by 0.5 %."""
    size = size or measure_scale(model)
    places, left = find_moving_places(model, size, KIND)
    result: list[Effect | Untestable] = []
    for place in places:
        name = f"{KIND} at {place.name}"
        typical = size.cubic(place.row)
        if not size.amplitude(place.row):
            result.append(Untestable(name=name, reason="the model has no harmonic force that would move it"))
        elif typical is None:
            result.append(Untestable(name=name, reason="no stiffness there can shift the first resonance by 0.5 %"))
        else:
            lower, upper, unit = -SOFTEST * typical, LARGEST * typical, place.unit("N/m^3", "N m")
            parameter = EffectParameter(name="stiffness", unit=unit, lower=lower, upper=upper, typical=typical)
            result.append(Cubic(name=name, row=place.row, parameters=(parameter,)))
    return [*result, *left]


def other_laws(effect: Effect, strength: float, model: Model, states: Sequence[SteadyState]) -> list[ForceLaw]:
    """Another power, a clearance and an even power; none for a user effect or zero strength.

    A hardening force may be a spring beyond a clearance. An even force softens most resonances, but not all to which a
    cubic spring is fitted.
    """
    if not isinstance(effect, Cubic) or not strength:
        return []
    largest = max((state.amplitude(effect.row) for state in states), default=0.0)
    if not largest:
        return []
    name, row, rotational = effect.name, effect.row, effect.parameters[0].unit == "N m"
    laws: list[ForceLaw] = [make_power_law(name, row, strength * largest**2, largest, 3.0, rotational=rotational)]
    if strength > 0:
        laws += make_clearance_laws(name, row, 0.75 * strength * largest**2, largest, rotational=rotational)
    stiffness = stuck_stiffness(model.system.stiffness, model.system.joints)
    try:
        compliance = float(row @ np.linalg.solve(stiffness, row))
    except np.linalg.LinAlgError:
        return laws  # rigid-body motion: the mean displacement by an even force is undefined
    if not compliance > 0:
        return laws
    return [*laws, *make_even_laws(name, row, strength, compliance, rotational=rotational)]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="places that move", physics=Cubic.physics, signature=Cubic.signature,
        parameters={"stiffness": ("N/m^3", "N m")}, candidates=candidates, order=4, other_laws=other_laws,
    )
)  # fmt: skip
