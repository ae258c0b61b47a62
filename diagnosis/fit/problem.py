"""What a diagnosis works on, whatever was measured: data beside a model, a first fit, and fits with one effect more."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.candidate.effect import Effect
from diagnosis.fit.calibration import Data, Fit
from diagnosis.fit.unknowns import Unknowns

PerRecord = Float[NDArray[np.float64], " records"]


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Which effects of a catalogue are tried with data of one kind, and how hard.

    Parameters
    ----------
    unseen
        Standard deviations in all by which an effect of typical strength must move the data to be seen [-].
    least_left
        Share of an effect that the fitted numbers must leave for it to be told from them [-].
    together
        Whether the data can be differentiated with respect to all effects at once.
    best, most
        Effects of the shortlist that are the best ones, and effects in all [-].
    worthless
        Gains that are not worth a fit.
    finalists, far_behind
        Effects of the shortlist that are tested, and by how much chi^2 all but the first two of them may be behind.
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
        None for what every fit has, alone.
    fit
        On the training data.
    held_chi2
        Reduced chi-squared of the held-out data [-].
    error, held_error
        |measured - predicted| / |measured|, training and held-out [-].
    held_errors, held_names
        The same of each held-out record, and the names of these; empty where there are none.
    blocks
        Mean squared residual of each block of the held-out records, shape (b,).
    """

    effect: Effect | None
    fit: Fit
    held_chi2: float
    error: float
    held_error: float
    held_errors: PerRecord = field(default_factory=lambda: np.zeros(0))
    held_names: tuple[str, ...] = ()
    blocks: Float[NDArray[np.float64], " b"] = field(default_factory=lambda: np.zeros(0))

    @property
    def name(self) -> str:
        """Of the effect; "nothing" without any."""
        return "nothing" if self.effect is None else self.effect.name

    @property
    def strength(self) -> float:
        """Of the effect [its unit]."""
        return float(self.fit.values[self._first]) if self.effect is not None else 0.0

    @property
    def deviation(self) -> float:
        """Standard deviation of the strength [its unit]."""
        return float(self.fit.deviation[self._first]) if self.effect is not None else 0.0

    @property
    def _first(self) -> int:
        """Place of the effect's numbers, which come last."""
        return len(self.fit.values) - len(self.effect.parameters if self.effect is not None else ())


class Problem(Protocol):
    """Training and held-out data beside a model whose calibration parameters, and added effects, are fitted."""

    @property
    def effort(self) -> Effort:
        """Which effects are tried, and how hard."""
        ...

    @property
    def train(self) -> Data:
        """What fits see."""
        ...

    @property
    def fit(self) -> Fit:
        """The first fit, without any further effect."""
        ...

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Calibration parameters and added effects, then others."""
        ...

    def tested(self, effect: Effect | None, fit: Fit) -> Refit:
        """A fit with an effect, or without any, on what no fit saw."""
        ...
