"""The numbers that a fit may change: calibration parameters with their priors, strengths of effects without."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter

Values = Float[NDArray[np.float64], " p"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Unknowns:
    """What is applied to a model, in order, and the numbers that it takes.

    Parameters
    ----------
    base
        The model as the engineer has it.
    effects
        Applied one after another.
    prior
        Standard deviation of each number; infinite for none.
    centre
        Values that priors are about; those that change nothing by default.
    pinned
        Values of the last effects that are not unknown.
    n_start
        Numbers before those of the effects, without bounds, that say how the data begin, such as where ring-downs
        start; no model depends on them [-].
    """

    base: Model
    effects: tuple[Effect, ...]
    prior: Values
    centre: Values | None = None
    pinned: tuple[float, ...] = ()
    n_start: int = 0

    @classmethod
    def from_effects(
        cls, base: Model, calibration: Sequence[tuple[Effect, float]], effects: Sequence[Effect], n_start: int = 0
    ) -> "Unknowns":
        """Calibration parameters with their priors, then effects without."""
        prior = [np.inf] * n_start + [sd for effect, sd in calibration for _ in effect.parameters]
        prior += [np.inf for effect in effects for _ in effect.parameters]
        applied = (*(effect for effect, _ in calibration), *effects)
        return cls(base=base, effects=applied, prior=np.array(prior), n_start=n_start)

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        """Of all effects, in order, but of those that are pinned."""
        every = tuple(parameter for effect in self.effects for parameter in effect.parameters)
        return every[: len(every) - len(self.pinned)]

    @property
    def names(self) -> tuple[str, ...]:
        """Of each number of the effects."""
        every = tuple(
            effect.name if len(effect.parameters) == 1 else f"{effect.name}, {parameter.name}"
            for effect in self.effects
            for parameter in effect.parameters
        )
        return every[: len(self.parameters)]

    @property
    def vanishing(self) -> Values:
        """Where nothing is changed."""
        return np.array([0.0] * self.n_start + [parameter.vanishes for parameter in self.parameters])

    @property
    def size(self) -> Values:
        """How much of each matters."""
        typical = [abs(parameter.typical - parameter.vanishes) for parameter in self.parameters]
        return np.array([1.0] * self.n_start + typical)

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Of each."""
        free = [(-np.inf, np.inf)] * self.n_start
        return free + [(parameter.lower, parameter.upper) for parameter in self.parameters]

    def clipped(self, values: Values) -> Values:
        """Within the bounds."""
        lower, upper = np.array(self.bounds).reshape(-1, 2).T
        return np.clip(values, lower, upper)

    def compose(self, values: Values) -> Model:
        """The model with all of them applied."""
        model, given = self.base, iter([*(float(value) for value in values[self.n_start :]), *self.pinned])
        for effect in self.effects:
            model = effect.apply(model, [next(given) for _ in effect.parameters])
        return model
