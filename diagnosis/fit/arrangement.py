"""A campaign beside a model, ready to be compared: training and held-out features, their covariance, a first fit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import find_sweep_directions, split_held_out
from correlation.model import Model
from correlation.noise.nuisance import Budget
from correlation.noise.scatter import Scatter
from correlation.noise.whitening import Whitening
from correlation.prediction import Prediction
from diagnosis.candidate.catalogue import Catalogue, list_effects
from diagnosis.candidate.effect import Effect
from diagnosis.fit.calibration import Fit, calibrate
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.comparison import FAINT, Comparison
from diagnosis.fit.finer_model import FinerModel
from diagnosis.fit.jitter import list_jitter
from diagnosis.fit.problem import Effort, Refit
from diagnosis.fit.unknowns import Unknowns, Values
from diagnosis.fit.weighting import DRAWS, Measured, weighted

Report = Callable[[str, float], None]

#: Friction histories in the covariance of each calibration; each is weighed where the one before it came to.
HISTORIES = (4, DRAWS)
#: chi^2 a number beyond which a calibration may have gone astray.
ASTRAY = 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Added:
    """An effect that was added before, and its values, which are fitted again with everything else."""

    effect: Effect
    values: Values


@dataclass(frozen=True, kw_only=True, eq=False)
class Arrangement:
    """What a diagnosis works on.

    Parameters
    ----------
    base
        The model as the engineer has it, with what was added before.
    calibration
        Parameters that every fit calibrates.
    added
        Effects that were added before; every fit sets their values anew.
    train, held_out
        Comparisons with the measurements to fit to, and with those that test a fit.
    settled, jitter
        The held-out comparison without jitter in its covariance, and the jitter as effects with priors: what a test on
        other repeats may set.
    fit
        The calibration parameters and what was added, calibrated on `train`.
    budget
        Numerical error of the model.
    finer
        The finer models of the budget, calibrated to what the fit says.
    """

    base: Model
    calibration: tuple[CalibrationParameter, ...]
    added: tuple[Effect, ...]
    train: Comparison
    held_out: Comparison
    settled: Comparison
    jitter: tuple[tuple[Effect, float], ...]
    fit: Fit
    budget: Budget
    finer: tuple[FinerModel, ...]

    effort: ClassVar[Effort] = Effort()

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Calibration parameters with their priors; what was added and more effects without."""
        return _unknowns(self.base, self.calibration, [*self.added, *effects])

    def tested(self, effect: Effect | None, fit: Fit) -> Refit:
        """Test on the held-out data; what differs between repeats may settle within its prior."""
        unknowns = Unknowns.from_effects(fit.model, self.jitter, ())
        settled = calibrate(self.settled, unknowns, unknowns.vanishing, fit.prediction)
        return Refit(
            effect=effect, fit=fit, held_chi2=settled.chi2 / settled.n_number,
            error=_relative(self.train, fit.prediction), held_error=_relative(self.settled, settled.prediction),
        )  # fmt: skip


def arrange(
    campaign: Campaign,
    base: Model,
    calibration: Sequence[CalibrationParameter],
    budget: Budget,
    report: Report | None = None,
    *,
    added: Sequence[Added] = (),
    catalogue_of: Callable[[Model], Catalogue] = list_effects,
) -> Arrangement:
    """Prepare features, covariance and the first fit.

    Parameters
    ----------
    campaign, base
        Measurements and model; sensors agree by name.
    calibration
        What every fit calibrates.
    budget
        Numerical error of the model.
    report
        Called with what is done, and chi^2 a number.
    added
        Effects that were found before, and where to start them.
    catalogue_of
        Effects of a finer model, among which those that were added are found.

    Raises
    ------
    CampaignError
        Nothing is held out, a single repeat, or a sensor that the model does not have.
    """
    effects = tuple(each.effect for each in added)
    unknowns = _unknowns(base, calibration, effects)
    finer = tuple(
        FinerModel(
            unknowns=replace(
                unknowns, base=each, effects=(*calibration, *(catalogue_of(each).alike(effect) for effect in effects))
            ),
            n_calibration=len(calibration),
        )
        for each in budget.refined
    )
    values = np.array([*unknowns.vanishing[: len(calibration)], *(value for each in added for value in each.values)])
    found = _compared(campaign, unknowns, values, budget, finer, report)
    return Arrangement(base=base, calibration=tuple(calibration), added=effects, budget=budget, **found)


def arrange_anew(arrangement: Arrangement, campaign: Campaign) -> Arrangement:
    """Another campaign of the same tests beside the same model; its fit begins where that of the first one ended."""
    of = arrangement
    return replace(of, **_compared(campaign, of.unknowns([]), of.fit.values, of.budget, of.finer, None))


def _compared(
    campaign: Campaign,
    unknowns: Unknowns,
    values: Values,
    budget: Budget,
    finer: Sequence[FinerModel],
    report: Report | None,
) -> dict[str, Any]:
    """What an arrangement has of a campaign, by the names of its fields: comparisons, jitter and fit."""
    train, held_out = _sides(campaign)
    model, fit = unknowns.compose(values), None
    # What a mesh does is the same beside other measurements.
    known = all(each.shift is not None for each in finer)
    prediction = train.predictor.predict(model)
    # Jitter and numerical error depend on where the contacts slip, and so on the fit that they weigh.
    for n_draw in HISTORIES:
        refined = [each.compose(values) for each in finer]
        comparison, _ = weighted(train, model, prediction, budget, refined, n_draw, fitted=fit is not None)
        fit = _calibrated(comparison, unknowns, values, prediction, _told(report, "calibration"))
        model, prediction, values = fit.model, fit.prediction, fit.values
        if not known:
            finer = [each.calibrated(comparison, fit) for each in finer]
    assert fit is not None
    refined = [each.compose(values) for each in finer]
    return {
        "train": comparison,
        "fit": fit,
        "finer": tuple(finer),
        **_unseen(held_out, model, prediction, budget, refined),
    }


def weigh_beside(
    campaign: Campaign, arrangement: Arrangement, effect: Effect, fit: Fit, catalogue_of: Callable[[Model], Catalogue]
) -> Arrangement:
    """The same measurements, weighed where the model with an effect stands; the fit is still that without it.

    What friction histories, jitter and a coarse mesh do depends on where contacts slip, and so on the model that says
    it. Where the model without an effect is calibrated far from what was measured, so is its covariance.

    Parameters
    ----------
    campaign, arrangement
        Measurements beside the model.
    effect, fit
        Fitted beside the calibration parameters and what was added.
    catalogue_of
        As in `arrange`.
    """
    of = arrangement
    train, held_out = _sides(campaign)
    finer = [each.with_effects([catalogue_of(each.unknowns.base).alike(effect)]) for each in of.finer]
    refined = [each.compose(fit.values) for each in finer]
    comparison, _ = weighted(train, fit.model, fit.prediction, of.budget, refined)
    without = _calibrated(comparison, of.unknowns([]), of.fit.values, of.fit.prediction, None)
    rest = _unseen(held_out, fit.model, fit.prediction, of.budget, refined)
    return replace(of, train=comparison, fit=without, **rest)


def _sides(campaign: Campaign) -> tuple[Measured, Measured]:
    """Measurements to fit to, and those that test a fit."""
    seen, unseen = split_held_out(campaign)
    sweeps = find_sweep_directions(campaign)
    return Measured.prepare(seen, sweeps), Measured.prepare(unseen, sweeps)


def _unseen(
    held_out: Measured, model: Model, near: Prediction, budget: Budget, refined: Sequence[Model]
) -> dict[str, Any]:
    """What an arrangement has of the held-out data."""
    tested, apart = weighted(held_out, model, held_out.predictor.predict(model, near), budget, refined)
    settled, shifts = _settled(tested, apart, model)
    return {"held_out": tested, "settled": settled, "jitter": tuple(shifts)}


def _calibrated(
    comparison: Comparison,
    unknowns: Unknowns,
    values: Values,
    prediction: Prediction,
    report: Callable[[float], None] | None,
) -> Fit:
    """The first fit; where it may have gone astray, begun anew from a fit of what is almost linear: the lowest level.

    Where a resonance is off by several of its widths, contacts slip in the model at frequencies at which they stick in
    the test, and no slope of the friction says that the resonance is elsewhere: friction then makes up for it as far
    as it can. The lowest level says it. What is hidden makes a fit bad as well, and both starts then end alike.
    """
    fit = calibrate(comparison, unknowns, values, prediction, report, exact=True)
    if fit.chi2 <= ASTRAY * fit.n_number:
        return fit
    points, row = comparison.features.points, comparison.features.row
    higher = ~points.free & (points.level > points.level[~points.free].min(initial=np.inf))
    deviation = comparison.whitening.deviation * np.where(higher[row], FAINT, 1.0)
    lowest = replace(comparison, whitening=Whitening(deviation=deviation, modes=comparison.whitening.modes))
    near = calibrate(lowest, unknowns, values, prediction)
    anew = calibrate(comparison, unknowns, near.values, near.prediction, report, exact=True)
    return min(fit, anew, key=lambda each: each.chi2)


def _settled(comparison: Comparison, seen: Scatter, model: Model) -> tuple[Comparison, list[tuple[Effect, float]]]:
    """The comparison without jitter in its covariance, and the jitter as effects with priors."""
    n_jitter = sum(len(covariance) for covariance in seen.jitter)
    modes = comparison.whitening.modes
    assert modes is not None
    without = Whitening(deviation=comparison.whitening.deviation, modes=modes[:, n_jitter:])
    # Of a mean of as many repeats as most points have.
    repeats = float(np.median(comparison.observed.count))
    return replace(comparison, whitening=without), list_jitter(model, [each / repeats for each in seen.jitter])


def _relative(comparison: Comparison, prediction: Prediction) -> float:
    """Root mean square relative error of the fundamentals of motion, each as large as it is measured."""
    there = np.isfinite(prediction.value) & comparison.features.fundamental
    measured = comparison.observed.value[there]
    return float(np.sqrt(np.mean(np.abs(prediction.value[there] / measured - 1) ** 2)))


def _unknowns(base: Model, calibration: Sequence[CalibrationParameter], effects: Sequence[Effect]) -> Unknowns:
    return Unknowns.from_effects(base, [(each, each.deviation) for each in calibration], effects)


def _told(report: Report | None, what: str) -> Callable[[float], None] | None:
    return None if report is None else lambda chi2: report(what, chi2)
