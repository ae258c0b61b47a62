"""Gains that a campaign does not know, found before its model is compared with it."""

from dataclasses import dataclass, replace

import numpy as np

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.feature.observation import find_sweep_directions, take_training_part
from correlation.model import Model
from diagnosis.fit.calibration import calibrate
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.unknown_gain import Gains, find_gains
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
        What was found.
    """

    setup: Setup
    gains: Gains

    @property
    def remarks(self) -> tuple[Suspicion, ...]:
        """What the data cannot tell."""
        return (Suspicion(where="drive", sentence=self.gains.fixed, remark=True),) if self.gains.fixed else ()

    def refine(self, model: Model, comparison: Comparison) -> tuple[Model, tuple[Calibrated, ...]]:
        """The model with the gains of least squares, and the gains with their standard deviations.

        Parameters
        ----------
        model
            Model with the gains that were found.
        comparison
            Training data.
        """
        unknowns = Unknowns.from_effects(model, [(each, np.inf) for each in self.gains.parameters], ())
        fit = calibrate(comparison, unknowns, unknowns.vanishing, exact=True)
        # Where the model is further off than noise says, so are the gains that it gives.
        excess = max(1.0, float(np.sqrt(np.mean(fit.residual**2))))
        return fit.model, self.report(fit.values, excess * fit.deviation)

    def report(self, factor: np.ndarray, deviation: np.ndarray) -> tuple[Calibrated, ...]:
        """Gains from the factors of a fit, in the order of the parameters."""
        return tuple(
            Calibrated(name=each.name, factor=float(each.start * a), deviation=float(each.start * b))
            for each, a, b in zip(self.gains.parameters, factor, deviation, strict=True)
        )


def set_gains(setup: Setup, campaign: Campaign) -> SetGains:
    """Find the gains that a campaign does not know, from its training data.

    Parameters
    ----------
    setup
        Set-up whose model has every sensor of the campaign.
    campaign
        Campaign.
    """
    if campaign.drive.calibrated and all(sensor.calibrated for sensor in campaign.sensors):
        return SetGains(setup=setup, gains=Gains())
    observed = take_training_part(campaign)
    gains = find_gains(setup.complete, campaign, observed, find_sweep_directions(campaign))
    budget = replace(setup.budget, refined=[gains.apply(finer) for finer in setup.budget.refined])
    return SetGains(setup=replace(setup, model=gains.apply(setup.model), budget=budget), gains=gains)
