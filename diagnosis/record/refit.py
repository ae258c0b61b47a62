"""Shortlisted effects fitted in earnest beside the accepted parameters, and tested on records that no fit saw."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from diagnosis.effect.candidate import Effect
from diagnosis.fit.one_effect import OneEffect
from diagnosis.fit.unknowns import Unknowns
from diagnosis.record.arrangement import RecordArrangement
from diagnosis.record.fit import RecordFit, fit_records
from diagnosis.record.screening import RecordScore

#: Effects that are refitted: the best few of those that promise anything.
MOST = 4
#: A second start from the typical strength pays if the first one lies this many times above or below it.
FAR = 3.0

PerRecord = Float[NDArray[np.float64], " records"]


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordRefit(OneEffect):
    """One effect, or none, fitted with the accepted parameters.

    Parameters
    ----------
    effect
        None for the accepted parameters (and added effects) alone.
    fit
        On the training records.
    errors, held_errors
        Of each training and each held-out record, |measured - predicted| / |measured| about the means [-].
    blocks
        Mean squared error of each block of the held-out records, shape (b,).
    """

    fit: RecordFit
    errors: PerRecord
    held_errors: PerRecord
    blocks: Float[NDArray[np.float64], " b"]

    @property
    def error(self) -> float:
        """Root mean square over the training records [-]."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def held_error(self) -> float:
        """Root mean square over the held-out records [-]."""
        return float(np.sqrt(np.mean(self.held_errors**2)))


def unchanged_records(arrangement: RecordArrangement) -> RecordRefit:
    """The accepted parameters and the added effects alone."""
    return _tested(arrangement, None, arrangement.fit)


def refit_records(arrangement: RecordArrangement, scores: Sequence[RecordScore]) -> list[RecordRefit]:
    """The most promising effects, each fitted beside the accepted parameters, least held-out error first."""
    chosen = [each for each in scores if each.gain > 0][:MOST]
    return sorted((_refit(arrangement, each) for each in chosen), key=lambda refit: refit.held_error)


def _refit(arrangement: RecordArrangement, score: RecordScore) -> RecordRefit:
    parameter, before = score.effect.parameters[0], arrangement.fit
    unknowns = arrangement.unknowns([score.effect])
    rest = [each.vanishes for each in score.effect.parameters[1:]]
    size, away = abs(parameter.typical - parameter.vanishes), score.strength - parameter.vanishes
    strengths = [score.strength]
    if not 1 / FAR < abs(away) / size < FAR:
        strengths.append(float(np.clip(parameter.vanishes + np.copysign(size, away), parameter.lower, parameter.upper)))
    found: list[RecordFit] = []
    for strength in strengths:
        try:
            found.append(
                fit_records(arrangement.train, unknowns, np.array([*before.values, strength, *rest]), before.starts)
            )
        except CampaignError:  # it runs away there: start from nothing
            nothing = np.array([*before.values, parameter.vanishes, *rest])
            found.append(fit_records(arrangement.train, unknowns, nothing, before.starts))
    best = min(found, key=lambda fit: float(fit.residual @ fit.residual))
    return _tested(arrangement, score.effect, best)


def _tested(arrangement: RecordArrangement, effect: Effect | None, fit: RecordFit) -> RecordRefit:
    """On the held-out records; ring-downs among them may start where they did."""
    held = arrangement.held
    residual = held.residual(fit.model, np.zeros(held.n_start))
    if residual is not None and held.n_start:
        residual = fit_records(held, Unknowns.of(fit.model, (), ()), np.zeros(0)).residual
    if residual is None:  # it runs away on what it was not fitted to
        residual = np.full(len(held.block), np.inf)
    return RecordRefit(
        effect=effect, fit=fit, errors=arrangement.train.errors(fit.residual), held_errors=held.errors(residual),
        blocks=held.by_block(residual**2),
    )  # fmt: skip
