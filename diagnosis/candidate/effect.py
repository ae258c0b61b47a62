"""Interface of a candidate effect: a named change of a model, with parameters and their bounds.

An effect needs no derivatives: `diagnosis.fit.tangent` differentiates the changed model.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from correlation.model import Model
from geometry.errors import InputError


class EffectError(InputError):
    """An invalid effect, or a value outside its bounds."""


@dataclass(frozen=True, kw_only=True)
class EffectParameter:
    """One parameter of an effect.

    Parameters
    ----------
    name, unit
        Name and unit, such as "mass" and "kg"; "-" for a ratio.
    lower, upper
        Bounds [its unit].
    typical
        Strength of engineering significance, at which the search starts [its unit].
    vanishes
        Neutral value, which changes nothing [its unit].
    """

    name: str
    unit: str
    lower: float
    upper: float
    typical: float
    vanishes: float = 0.0

    def __post_init__(self) -> None:
        if not self.lower <= self.vanishes <= self.upper or not self.lower <= self.typical <= self.upper:
            raise EffectError(
                f"{self.name}: {self.vanishes:g} (no effect) and {self.typical:g} (typical) must lie within "
                f"{self.lower:g} to {self.upper:g} {self.unit}"
            )
        if self.typical == self.vanishes:
            raise EffectError(
                f"{self.name} = {self.typical:g} {self.unit} is both the typical value and the one without effect"
            )

    @property
    def is_ratio(self) -> bool:
        """Whether it is a positive factor."""
        return self.unit == "-" and self.lower > 0

    def describe(self, name: str, value: float) -> str:
        """Name and value, such as "kt x 1.5" or "shift of lid = 0.002 m"."""
        return f"{name} x {value:.4g}" if self.is_ratio else f"{name} = {value:.4g} {self.unit}"

    def is_at_bound(self, value: float) -> bool:
        """Whether a value is at or beyond a bound."""
        return not self.lower < value < self.upper


class Effect(Protocol):
    """A candidate: an effect that may be missing, and its place."""

    @property
    def name(self) -> str:
        """Unique name of kind and place, such as "mass at tip z"."""
        ...

    @property
    def kind(self) -> str:
        """Kind without the place, such as "mass"."""
        ...

    @property
    def physics(self) -> str:
        """Physical cause in one sentence."""
        ...

    @property
    def signature(self) -> str:
        """Signature in the measurements."""
        ...

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Parameters, the strength first."""
        ...

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model with the effect; at the neutral values it behaves like the model without it."""
        ...


def changes_joints(effect: Effect, model: Model) -> bool:
    """Whether an effect changes a joint of a model; otherwise it is linear, the same at all amplitudes."""
    changed = effect.apply(model, [parameter.typical for parameter in effect.parameters])
    before, after = model.system.joints, changed.system.joints
    return len(before) != len(after) or any(one is not other for one, other in zip(before, after, strict=True))


@dataclass(frozen=True, kw_only=True)
class Untestable:
    """An effect that these data or this model cannot test, with the reason."""

    name: str
    reason: str
