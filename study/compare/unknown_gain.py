"""Unknown gains of a campaign, estimated before the model is compared with it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.feature.observation import find_sweep_directions, take_training_part
from correlation.model import Model
from correlation.prediction import Prediction
from diagnosis.fit.calibration import Ending, calibrate
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.unknown_gain import SensorGains, find_gains
from study.case.setup import Setup
from study.compare.result import Calibrated


@dataclass(frozen=True, kw_only=True, eq=False)
class SetGains:
    """A set-up whose model has the gains that fit best.

    Parameters
    ----------
    setup
        The set-up.
    gains
        Estimated gains.
    """

    setup: Setup
    gains: SensorGains

    @property
    def remarks(self) -> tuple[Suspicion, ...]:
        """Remarks on gains that the data cannot determine."""
        return (Suspicion(where="drive", sentence=self.gains.fixed, remark=True),) if self.gains.fixed else ()

    def refine(self, model: Model, comparison: Comparison) -> tuple[Model, tuple[Calibrated, ...]]:
        """The model with the gains of least squares, and the gains with their standard deviations.

        Parameters
        ----------
        model
            Model with the estimated gains.
        comparison
            Training data.
        """
        unknowns = Unknowns.from_effects(model, [(item, np.inf) for item in self.gains.parameters], ())
        fit = calibrate(comparison, unknowns, unknowns.vanishing, ending=Ending.EXACT)
        missed, scatter = _measure_miss(comparison, fit.prediction, [item.sensor for item in self.gains.parameters])
        if missed > scatter:
            # Far from the measurements, least squares follow the few readings of least noise, and miss the others.
            kept = np.ones(len(fit.values))
            return model, self.report(kept, scatter * kept)
        # If the misfit exceeds the noise, scale the deviations of the gains accordingly.
        excess = max(1.0, float(np.sqrt(np.mean(fit.residual**2))))
        return fit.model, self.report(fit.values, excess * fit.deviation)

    def report(self, factor: np.ndarray, deviation: np.ndarray) -> tuple[Calibrated, ...]:
        """Gains from the factors of a fit, in the order of the parameters."""
        return tuple(
            Calibrated(name=item.name, factor=float(item.start * a), deviation=float(item.start * b))
            for item, a, b in zip(self.gains.parameters, factor, deviation, strict=True)
        )


def _measure_miss(comparison: Comparison, prediction: Prediction, sensors: Sequence[str]) -> tuple[float, float]:
    """Median ratio of the readings to their prediction, and their scatter about it.

    Both are statistics of ln |X_m / X_p| of the fundamentals of the sensors with a fitted gain, or of all motions if
    only the gain of the drive was fitted: the size of the median, and 1.48 times the median distance from it, which is
    the standard deviation for a normal distribution [-].
    """
    observed = comparison.observed
    rows = observed.motion & (observed.points.harmonic == 1)
    own = rows & np.isin(observed.points.sensor, sensors)
    rows = own if own.any() else rows
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(np.abs(observed.value[rows] / prediction.value[rows]))
    ratio = ratio[np.isfinite(ratio)]
    if not len(ratio):
        return 0.0, 0.0
    middle = float(np.median(ratio))
    return abs(middle), 1.4826 * float(np.median(np.abs(ratio - middle)))


def set_gains(setup: Setup, campaign: Campaign) -> SetGains:
    """Estimate the unknown gains of a campaign from its training data.

    Parameters
    ----------
    setup
        Set-up whose model has every sensor of the campaign.
    campaign
        Campaign.
    """
    if campaign.drive.calibrated and all(sensor.calibrated for sensor in campaign.sensors):
        return SetGains(setup=setup, gains=SensorGains())
    observed = take_training_part(campaign)
    gains = find_gains(setup.complete, campaign, observed, find_sweep_directions(campaign))
    budget = replace(setup.budget, refined=[gains.apply(finer) for finer in setup.budget.refined])
    return SetGains(setup=replace(setup, model=gains.apply(setup.model), budget=budget), gains=gains)
