"""Interface of a diagnosis to data of any kind: data beside a model, a first fit, and fits with a further effect."""

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

#: Reduced chi-squared by noise and stated errors that these do not explain: what is left is as large as they are [-].
UNEXPLAINED_CHI2 = 2.0


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Selection of the effects that are fitted to one kind of data.

    Parameters
    ----------
    unseen
        Change of the data by an effect of typical strength below which it is invisible [standard deviations].
    least_left
        Least share of an effect that the fitted parameters cannot absorb, for it to be distinguishable [-].
    together
        Whether the data can be differentiated with respect to all effects at once.
    best, most
        Number of best effects of the shortlist, and of all its effects [-].
    worthless
        Largest gain of chi^2 at which an effect is not fitted [-].
    finalists, far_behind
        Number of effects of the shortlist that are tested, and the largest chi^2 that all but the first two of them may
        be behind the best [-].
    """

    unseen: float = 0.3
    least_left: float = 0.0
    together: bool = True
    best: int = 3
    most: int = 6
    worthless: float = 3.0
    finalists: int = 3
    far_behind: float = 40.0


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
        Reduced chi-squared of the held-out data, by the model error that they show [-].
    error, held_out_error
        |measured - predicted| / |measured|, training and held-out [-].
    held_out_errors, held_out_names
        The same error of each held-out record, and their names; empty without records.
    blocks
        Mean squared residual of each block of the held-out records, shape (b,).
    n_held_out
        Held-out numbers [-].
    reduced_chi2_without_model_error, held_out_reduced_chi2_without_model_error
        Reduced chi-squared of both by noise and stated errors alone, without model error [-]; None where there is none.
    held_out_jumps
        Jumps of the held-out sweeps between two steady states, measured and predicted.
    held_out_cost
        -2 ln of the density of the held-out data, their jitter integrated out, up to a constant [-].
    gain, held_out_gain
        Falls of chi^2 of the training and the held-out data by the effect [-]; of fits with covariances of their own
        the smaller ones of the falls of -2 ln p by both.
    cost
        -2 ln of the density of all data by the covariance of its own model, up to a constant [-]; None where fits have
        no covariances of their own.
    worsens
        Whether the effect makes the held-out error larger, whatever it gains.
    beside
        Second effect of a fit with two, whose values come last.
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
        """Reduced chi-squared of the training data by noise and stated errors, which fits have in common [-]."""
        without = self.reduced_chi2_without_model_error
        return self.fit.chi2 / self.fit.n_number if without is None else without

    @property
    def held_out_reduced_chi2_by_noise(self) -> float:
        """Reduced chi-squared of the held-out data by noise and stated errors, which fits have in common [-]."""
        without = self.held_out_reduced_chi2_without_model_error
        return self.held_out_reduced_chi2 if without is None else without

    @property
    def name(self) -> str:
        """Name of the effect; "nothing" without one."""
        return "nothing" if self.effect is None else self.effect.name

    @property
    def place(self) -> str:
        """Place of the effect; empty for one that acts at none."""
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
        """Whether the interval of the strength holds the value that changes nothing, or there is no interval."""
        if self.effect is None:
            return True
        return not abs(self.strength - self.effect.parameters[0].vanishes) > TWO_SIDED_95 * self.deviation

    @property
    def _first(self) -> int:
        """Index of the first parameter of the effect, which come last, or before those of `beside`."""
        last = [each for each in (self.effect, self.beside) if each is not None]
        return len(self.fit.values) - sum(len(each.parameters) for each in last)


class Screened(Protocol):
    """Data beside a model whose calibration parameters, and added effects, are fitted."""

    @property
    def effort(self) -> Effort:
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


class Problem(Screened, Protocol):
    """The same with held-out data that test a fit."""

    def tested(self, effect: Effect | None, fit: Fit) -> Refit:
        """Test of a fit, with an effect or without, on the held-out data."""
        ...
