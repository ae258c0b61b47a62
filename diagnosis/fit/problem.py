"""Interface of a diagnosis to data of any kind: comparison with a model, first fit, and fits with a further effect."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.metric.jump_error import JumpError
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.effect import Effect
from diagnosis.fit.calibration import Data, Fit
from diagnosis.fit.fit_parameter import Unknowns

PerRecord = Float[NDArray[np.float64], " records"]

#: Reduced chi-squared above which noise and stated errors do not explain a residual: what remains is as large [-].
UNEXPLAINED_CHI2 = 2.0


@dataclass(frozen=True, kw_only=True)
class EffectSelection:
    """Criteria by which effects are selected for fits to one kind of data.

    Parameters
    ----------
    least_change
        Change of the data by an effect of typical strength below which it is invisible [standard deviations].
    least_unabsorbed_share
        Least share of an effect that the fitted parameters cannot absorb, for it to be distinguishable [-].
    slopes_at_once
        Whether the data can be differentiated with respect to all effects at once.
    n_best, n_shortlisted
        Number of effects with the largest gain in the shortlist, and of all effects in it [-].
    least_gain
        Gain of chi^2 that an effect must exceed to be fitted [-].
    n_finalist, largest_chi2_gap
        Number of shortlisted effects that are tested on held-out data, and the largest difference of chi^2 from the
        best one, for all but the first two of them [-].
    """

    least_change: float = 0.3
    least_unabsorbed_share: float = 0.0
    slopes_at_once: bool = True
    n_best: int = 3
    n_shortlisted: int = 6
    least_gain: float = 3.0
    n_finalist: int = 3
    largest_chi2_gap: float = 40.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Refit:
    """One effect, or none, fitted with the calibration parameters and tested on held-out data.

    Parameters
    ----------
    effect
        Effect; None for the calibration parameters and added effects alone.
    fit
        Fit to the training data.
    held_out_reduced_chi2
        Reduced chi-squared of the held-out data, with the model error estimated from them [-].
    error, held_out_error
        |measured - predicted| / |measured|, training and held-out [-].
    held_out_errors, held_out_names
        The same error for each held-out record, and the names of the records; empty without records.
    blocks
        Mean squared residual of each block of the held-out records, shape (b,).
    n_held_out
        Number of held-out values [-].
    reduced_chi2_without_model_error, held_out_reduced_chi2_without_model_error
        Reduced chi-squared of both by noise and stated errors alone [-]; None if the covariance has no model error.
    held_out_jumps
        Jumps of the held-out sweeps between two steady states, measured and predicted.
    held_out_cost
        -2 ln of the density of the held-out data, their jitter integrated out, up to a constant [-].
    gain, held_out_gain
        Falls of chi^2 of the training and the held-out data by the effect [-]. If each model has its own covariance:
        the smaller fall of -2 ln p with the common covariance and with its own; only the former if chance explains it.
    cost
        -2 ln of the density of all data with the covariance of the last fit, usually that of its own model, up to a
        constant [-]; None if models do not have their own covariances.
    worsens
        Whether the effect raises the held-out error, regardless of its gain.
    beside
        Second effect of a fit with two; its values come last.
    """

    effect: Effect | None
    fit: Fit
    held_out_reduced_chi2: float
    error: float
    held_out_error: float
    held_out_errors: PerRecord = field(default_factory=lambda: np.zeros(0))
    held_out_names: tuple[str, ...] = ()
    blocks: Float[NDArray[np.float64], " b"] = field(default_factory=lambda: np.zeros(0))
    n_held_out: int = 0
    reduced_chi2_without_model_error: float | None = None
    held_out_reduced_chi2_without_model_error: float | None = None
    held_out_jumps: tuple[JumpError, ...] = ()
    held_out_cost: float = 0.0
    gain: float = 0.0
    held_out_gain: float = 0.0
    cost: float | None = None
    worsens: bool = False
    beside: Effect | None = None

    @property
    def reduced_chi2_by_noise(self) -> float:
        """Reduced chi-squared of the training data by noise and stated errors, which are common to all fits [-]."""
        without = self.reduced_chi2_without_model_error
        return self.fit.chi2 / self.fit.n_number if without is None else without

    @property
    def held_out_reduced_chi2_by_noise(self) -> float:
        """Reduced chi-squared of the held-out data by noise and stated errors, which are common to all fits [-]."""
        without = self.held_out_reduced_chi2_without_model_error
        return self.held_out_reduced_chi2 if without is None else without

    @property
    def name(self) -> str:
        """Name of the effect; "nothing" without one."""
        return "nothing" if self.effect is None else self.effect.name

    @property
    def place(self) -> str:
        """Place of the effect; empty for an effect without a place."""
        return self.name.partition(" at ")[2]

    @property
    def label(self) -> str:
        """Name of the effect, or of both that were fitted together."""
        return self.name if self.beside is None else f"{self.name} and {self.beside.name}"

    @property
    def strength(self) -> float:
        """Strength of the effect [its unit]."""
        return float(self.fit.values[self._first]) if self.effect is not None else 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of the strength [its unit]."""
        return float(self.fit.deviation[self._first]) if self.effect is not None else 0.0

    @property
    def may_vanish(self) -> bool:
        """Whether the 95 % interval of the strength contains the neutral value, or there is no interval."""
        if self.effect is None:
            return True
        return not abs(self.strength - self.effect.parameters[0].vanishes) > TWO_SIDED_95 * self.deviation

    @property
    def _first(self) -> int:
        """Index of the first parameter of the effect; its parameters come last, or before those of `beside`."""
        last = [item for item in (self.effect, self.beside) if item is not None]
        return len(self.fit.values) - sum(len(item.parameters) for item in last)


class Screened(Protocol):
    """Data and a model whose calibration parameters and added effects are fitted."""

    @property
    def selection(self) -> EffectSelection:
        """Selection of the effects that are fitted."""
        ...

    @property
    def train(self) -> Data:
        """Training data."""
        ...

    @property
    def fit(self) -> Fit:
        """First fit, without a further effect."""
        ...

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Calibration parameters and added effects, then the given effects."""
        ...


class FitProblem(Screened, Protocol):
    """The same with held-out data that test a fit."""

    def tested(self, effect: Effect | None, fit: Fit) -> Refit:
        """Test of a fit, with or without an effect, on the held-out data."""
        ...
