"""A first value of a parameter, what it was read from, and how it is known to be wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class FirstEstimate:
    """A first value, read from data without a fit of the model.

    Parameters
    ----------
    parameter
        "kt", "mu" or "zeta", calibration parameters of the case; or "preload", which a case gives by line.
    value, interval, unit
        Value with its 95 % interval; of an upper bound it begins at 0, of a lower one it has no end.
    model_value
        What the model has in its place [same unit].
    source
        What it was read from.
    bias
        Known biases, in words.
    may_be_less
        Whether a bias can only have raised the value: an upper bound.
    """

    parameter: str
    value: float
    interval: tuple[float, float]
    unit: str
    model_value: float
    source: str
    bias: tuple[str, ...] = ()
    may_be_less: bool = False

    @property
    def factor(self) -> float:
        """Value over the model's [-]."""
        return self.value / self.model_value

    @property
    def is_bound(self) -> bool:
        """Whether it is a bound alone."""
        return self.may_be_less or not np.isfinite(self.interval).all()

    @property
    def contradicts_model(self) -> bool:
        """Whether the model's value is outside the interval."""
        return not self.interval[0] <= self.model_value <= self.interval[1]

    @property
    def relative_width(self) -> float:
        """Width of the interval beside the value [-]."""
        return (self.interval[1] - self.interval[0]) / abs(self.value)


def choose_estimate(estimates: Sequence[FirstEstimate], parameter: str) -> FirstEstimate | None:
    """The estimate of a parameter that is written: the most certain one, or a bound that the case contradicts.

    A bound within which the case lies says nothing against its value. Of several the one that is furthest from it.
    """
    own = [item for item in estimates if item.parameter == parameter and np.isfinite(item.factor) and item.factor > 0]
    certain = [item for item in own if not item.is_bound]
    if certain:
        return min(certain, key=lambda item: item.relative_width)
    against = [item for item in own if item.contradicts_model]
    return max(against, key=lambda item: abs(np.log(item.factor)), default=None)


def list_contradictions(estimates: Sequence[FirstEstimate]) -> list[str]:
    """Estimates of one parameter whose intervals, as factors, have nothing in common, in words."""
    result = []
    for parameter in ("kt", "mu", "zeta"):
        best = choose_estimate(estimates, parameter)
        for item in estimates:
            if best is None or item is best or item.parameter != parameter:
                continue
            low, high = (end / item.model_value for end in item.interval)
            own_low, own_high = (end / best.model_value for end in best.interval)
            if (low > own_high and not item.may_be_less) or (high < own_low and not best.may_be_less):
                result.append(
                    f"{parameter}: {item.source} gives {item.factor:.3g} times the model, {best.source} "
                    f"{best.factor:.3g} times: one factor cannot fit both"
                )
    return result
