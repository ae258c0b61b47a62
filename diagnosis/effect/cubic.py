"""A cubic spring: membrane stretching, a hardening or softening support."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.place import find_moving_places, with_cubic_spring
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind
from hbsolve.state import SteadyState
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.joint_law.power_spring import PowerSpring
from reduction.joint_law.registry import Joint

KIND = "cubic"
#: Bounds in typical strengths: softening could let a place escape from its well, and friction may hold amplitudes far
#: below the stuck ones that the typical strength is reckoned at.
SOFTEST, LARGEST = 20.0, 1e5
#: Largest exponent that is tried: a stop that is just reached looks like one of this kind.
MOST_STEEP = 11.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Cubic:
    """f = k u^3 along a row, shape (r,) [-]."""

    name: str
    row: Float[NDArray[np.float64], " r"]
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = "A spring to the ground hardens (softens, if negative) with the cube of the displacement."
    signature: str = (
        "Resonances rise with the square of the amplitude, most at the highest level; third harmonic; the missing "
        "force is opposite to the displacement (180 deg) with exponent 3; without contacts as well."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """One joint more, also where its stiffness is zero."""
        (stiffness,) = values
        return with_cubic_spring(model, self.name, self.row, stiffness)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    r"""A cubic spring at each place, typically 3/4 k a^2 of a spring that shifts the resonance by 0.5 %."""
    size = size or measure_scale(model)
    places, left = find_moving_places(model, size, KIND)
    found: list[Effect | Untestable] = []
    for place in places:
        name = f"{KIND} at {place.name}"
        typical = size.cubic(place.row)
        if not size.amplitude(place.row):
            found.append(Untestable(name=name, reason="the model has no harmonic force that would move it"))
        elif typical is None:
            found.append(Untestable(name=name, reason="no stiffness there can shift the first resonance by 0.5 %"))
        else:
            lower, upper, unit = -SOFTEST * typical, LARGEST * typical, place.unit("N/m^3", "N m")
            parameter = EffectParameter(name="stiffness", unit=unit, lower=lower, upper=upper, typical=typical)
            found.append(Cubic(name=name, row=place.row, parameters=(parameter,)))
    return [*found, *left]


@dataclass(frozen=True, kw_only=True, eq=False)
class Exponent:
    """Exponent of the force of a cubic spring that is in a model.

    Parameters
    ----------
    spring
        Name of the spring.
    reference
        Displacement at which its force stays the same [m].
    """

    name: str
    spring: str
    reference: float
    parameters: tuple[EffectParameter, ...]
    kind: str = "exponent"
    physics: str = "The force grows with another power of the displacement."
    signature: str = "The resonance rises with the amplitude by another power than two."

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The spring as one of another power."""
        (exponent,) = values
        return model.with_system(joints=[self._freed(joint, exponent) for joint in model.system.joints])

    def _freed(self, joint: Joint, exponent: float) -> Joint:
        if not isinstance(joint, CubicSpring) or joint.name != self.spring:
            return joint
        secant = joint.stiffness * self.reference**2
        return PowerSpring(
            name=joint.name, direction=joint.direction, stiffness=secant, reference=self.reference, exponent=exponent
        )


def free_exponent(effect: Effect, states: Sequence[SteadyState]) -> Effect | None:
    """Exponent of a cubic spring that was added, about its largest displacement; none of a user's own effect."""
    if not isinstance(effect, Cubic):
        return None
    exponent = EffectParameter(name="exponent", unit="-", lower=1.0, upper=MOST_STEEP, typical=4.0, vanishes=3.0)
    largest = max((state.amplitude(effect.row) for state in states), default=0.0)
    return Exponent(
        name=f"exponent of {effect.name}", spring=effect.name, reference=largest or 1.0, parameters=(exponent,)
    )


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="places that move", physics=Cubic.physics, signature=Cubic.signature,
        parameters={"stiffness": ("N/m^3", "N m")}, candidates=candidates, order=4, free_exponent=free_exponent,
    )
)  # fmt: skip
