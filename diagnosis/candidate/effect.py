"""What a candidate effect is: a named change of a test model, with the values that it may take.

An effect needs no derivatives: `diagnosis.fit.tangent` differentiates what it does to the model's data.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from correlation.model import Model
from geometry.errors import InputError


class EffectError(InputError):
    """An effect that is not one, or a value that it cannot take."""


@dataclass(frozen=True, kw_only=True)
class EffectParameter:
    """One number of an effect.

    Parameters
    ----------
    name, unit
        Such as "mass" and "kg"; "-" for a ratio.
    lower, upper
        Bounds.
    typical
        A strength at which an engineer would care; where the effect is looked for first.
    vanishes
        The value that changes nothing.
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
            raise EffectError(f"{self.name} = {self.typical:g} {self.unit} is both typical and no effect")


class Effect(Protocol):
    """A candidate: what may be missing, and where."""

    @property
    def name(self) -> str:
        """Unique: what and where, such as "mass at tip z"."""
        ...

    @property
    def kind(self) -> str:
        """What, without where, such as "mass"."""
        ...

    @property
    def physics(self) -> str:
        """One sentence for the engineer."""
        ...

    @property
    def signature(self) -> str:
        """How it shows in the measurements."""
        ...

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Its numbers, the strength first."""
        ...

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The model with the effect; at the vanishing values it behaves as the model without."""
        ...


@dataclass(frozen=True, kw_only=True)
class Untestable:
    """An effect that these data or this model say nothing about, and why."""

    name: str
    reason: str
