"""First estimate of a parameter, with its source and its known biases."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, kw_only=True)
class FirstEstimate:
    """First estimate of a parameter, read from data without a fit of the model.

    Parameters
    ----------
    parameter
        "kt", "mu" or "zeta", calibration parameters of the case; or "preload", which a case gives by line.
    value, interval, unit
        Value with its 95 % interval; that of an upper bound begins at 0, that of a lower bound ends at infinity.
    model_value
        Value of the model [same unit].
    source
        Data from which the value was read, in words.
    bias
        Known biases, in words.
    may_be_less
        Whether the biases can only have raised the value: it is an upper bound.
    """

    parameter: str
    value: float
    interval: tuple[float, float]
    unit: str
    model_value: float
    source: str
    bias: tuple[str, ...] = ()
    is_upper_bound: bool = False

    @property
    def factor(self) -> float:
        """Ratio of the value to that of the model [-]."""
        return self.value / self.model_value

    @property
    def is_bound(self) -> bool:
        """Whether the estimate is only a bound."""
        return self.is_upper_bound or not np.isfinite(self.interval).all()

    @property
    def contradicts_model(self) -> bool:
        """Whether the model's value is outside the interval."""
        return not self.interval[0] <= self.model_value <= self.interval[1]

    @property
    def relative_width(self) -> float:
        """Width of the interval relative to the value [-]."""
        return (self.interval[1] - self.interval[0]) / abs(self.value)


def choose_estimate(estimates: Sequence[FirstEstimate], parameter: str) -> FirstEstimate | None:
    """Choose the estimate of a parameter that is written into the case.

    It is the estimate with the smallest relative interval. If there are only bounds, it is the bound that contradicts
    the value of the model, of several the one with the largest factor on it; None if no bound contradicts it.
    """
    own = [item for item in estimates if item.parameter == parameter and np.isfinite(item.factor) and item.factor > 0]
    certain = [item for item in own if not item.is_bound]
    if certain:
        return min(certain, key=lambda item: item.relative_width)
    against = [item for item in own if item.contradicts_model]
    return max(against, key=lambda item: abs(np.log(item.factor)), default=None)


def list_contradictions(estimates: Sequence[FirstEstimate]) -> list[str]:
    """Sentences on estimates of one parameter whose intervals, as factors on the model's value, do not overlap."""
    result = []
    for parameter in ("kt", "mu", "zeta"):
        best = choose_estimate(estimates, parameter)
        for item in estimates:
            if best is None or item is best or item.parameter != parameter:
                continue
            low, high = (end / item.model_value for end in item.interval)
            own_low, own_high = (end / best.model_value for end in best.interval)
            if (low > own_high and not item.is_upper_bound) or (high < own_low and not best.is_upper_bound):
                result.append(
                    f"{parameter}: {item.source} gives {item.factor:.3g} times the model, {best.source} "
                    f"{best.factor:.3g} times: one factor cannot fit both"
                )
    return result
