"""Parameters of a fit: calibration parameters with priors, parameters of effects without."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter
from hbsolve.errors import ModelError
from reduction.errors import JointError

Values = Float[NDArray[np.float64], " p"]


def make_start(fitted: Values, effect: Effect, strength: float) -> Values:
    """Fitted values, then the strength of an effect, then its other parameters at their neutral values."""
    return np.array([*fitted, strength, *(parameter.vanishes for parameter in effect.parameters[1:])])


@dataclass(frozen=True, kw_only=True, eq=False)
class Unknowns:
    """Effects that are applied to a model, in order, and their parameters.

    Parameters
    ----------
    base
        Model without them.
    effects
        Effects, applied one after another.
    prior
        Standard deviation of the prior of each parameter, shape (p,); infinite without a prior.
    centre
        Centres of the priors, shape (p,); the neutral values by default.
    pinned
        Values of the last parameters, which are not fitted.
    n_start
        Number of initial values of the data, such as initial states of ring-downs. They come first, have no bounds, and
        do not change the model [-].
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
        """Parameters of all effects, in order, without the pinned ones."""
        every = tuple(parameter for effect in self.effects for parameter in effect.parameters)
        return every[: len(every) - len(self.pinned)]

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each parameter."""
        every = tuple(
            effect.name if len(effect.parameters) == 1 else f"{effect.name}, {parameter.name}"
            for effect in self.effects
            for parameter in effect.parameters
        )
        return every[: len(self.parameters)]

    @property
    def vanishing(self) -> Values:
        """Neutral values, which change nothing, shape (p,)."""
        return np.array([0.0] * self.n_start + [parameter.vanishes for parameter in self.parameters])

    @property
    def size(self) -> Values:
        """Typical size of each parameter, shape (p,)."""
        typical = [abs(parameter.typical - parameter.vanishes) for parameter in self.parameters]
        return np.array([1.0] * self.n_start + typical)

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Lower and upper bound of each parameter."""
        free = [(-np.inf, np.inf)] * self.n_start
        return free + [(parameter.lower, parameter.upper) for parameter in self.parameters]

    def clipped(self, values: Values) -> Values:
        """Values within the bounds, shape (p,)."""
        lower, upper = np.array(self.bounds).reshape(-1, 2).T
        return np.clip(values, lower, upper)

    def prior_residuals(self, values: Values) -> Values:
        """Distances of values from the centres of their priors, in standard deviations, shape (p,) [-]."""
        centre = self.vanishing if self.centre is None else self.centre
        return np.asarray((values - centre) / self.prior)

    def limited(self, covariance: Float[NDArray[np.float64], "p p"]) -> Float[NDArray[np.float64], "p p"]:
        """Covariance of values, scaled so that no standard deviation exceeds the range of the bounds, shape (p, p)."""
        lower, upper = np.array(self.bounds).reshape(-1, 2).T
        deviation = np.sqrt(np.diag(covariance))
        share = np.minimum((upper - lower) / np.where(deviation > 0, deviation, 1.0), 1.0)
        return np.asarray(covariance * np.outer(share, share))

    def neighbour(self, values: Values, number: int, share: float) -> tuple[Model, float]:
        """Model with one value moved by a share of its typical size, and the signed step.

        The step is negative if a positive one would exceed the upper bound, or is invalid for the model.

        Raises
        ------
        ModelError
            The model accepts neither.
        """
        step = share * self.size[number]
        sides = (step, -step) if values[number] + step <= self.bounds[number][1] else (-step,)
        for side in sides:
            moved = np.array(values, dtype=np.float64)
            moved[number] += side
            try:
                return self.compose(moved), side
            except ModelError:
                if side == sides[-1]:
                    raise
        raise AssertionError("there is at least one side")

    def compose(self, values: Values) -> Model:
        """Model with all effects applied.

        Raises
        ------
        ModelError
            Values that together define an invalid joint, such as a friction coefficient beyond that of any two solids;
            a fit rejects such a step.
        """
        model, given = self.base, iter([*(float(value) for value in values[self.n_start :]), *self.pinned])
        for effect in self.effects:
            try:
                model = effect.apply(model, [next(given) for _ in effect.parameters])
            except JointError as error:
                raise ModelError(f"{effect.name}: {error}") from error
        return model
