"""Training and held-out data, and a model whose calibration parameters are fitted to the training features."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from correlation.data_type.registry import Datum
from correlation.data_type.ring_down import SAME_MODE
from correlation.errors import CampaignError
from correlation.model import Model
from diagnosis.candidate.effect import Effect
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.arrangement import make_first_values, make_unknowns
from diagnosis.fit.calibration import Ending, Fit, calibrate
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.comparison import NOT_FOUND
from diagnosis.fit.feature_comparison import FeatureComparison
from diagnosis.fit.fit_parameter import Unknowns
from diagnosis.fit.problem import EffectSelection, Refit
from hbsolve.errors import ModelError

#: If no datum is marked as held out, every third one is held out.
EVERY = 3


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureArrangement:
    """Data and model of a diagnosis.

    Parameters
    ----------
    base
        Model without the added effects.
    calibration
        Calibration parameters, which every fit sets.
    added
        Effects added in earlier rounds.
    train, held_out
        Features of training and of held-out data.
    fit
        Fit of the calibration parameters and the added effects.
    """

    base: Model
    calibration: tuple[CalibrationParameter, ...]
    added: tuple[AddedEffect, ...]
    train: FeatureComparison
    held_out: FeatureComparison
    fit: Fit

    #: Features are few and have common errors: the gain of chi^2 alone neither justifies nor excludes a fit.
    selection: ClassVar[EffectSelection] = EffectSelection(
        least_change=0.0,
        slopes_at_once=False,
        n_best=4,
        n_shortlisted=4,
        least_gain=0.0,
        n_finalist=4,
        largest_chi2_gap=np.inf,
    )

    def unknowns(self, effects: Sequence[Effect]) -> Unknowns:
        """Calibration parameters with their priors; added effects and the given ones without."""
        applied = [*(item.effect for item in self.added), *effects]
        return make_unknowns(self.base, self.calibration, applied)

    def find_worst_frequency(self, fit: Fit) -> tuple[float, float] | None:
        """Measured frequency and relative error of the worst mode of a fitted model [Hz, -]; None without any mode.

        If the frequency of a mode varies with amplitude, its smallest error is used: a model that lacks an effect may
        still match the mode at one amplitude.
        """
        unit = np.array([unit for features in self.train.features for unit in features.unit])
        rows = np.flatnonzero((unit == "Hz") & np.isfinite(fit.prediction))
        if not len(rows):
            return None
        rows = rows[np.argsort(self.train.measured[rows])]
        measured = self.train.measured[rows]
        off = fit.prediction[rows] / measured - 1
        modes = np.split(np.arange(len(rows)), 1 + np.flatnonzero(np.diff(measured) > SAME_MODE * measured[:-1]))
        least = [int(mode[np.argmin(np.abs(off[mode]))]) for mode in modes]
        worst = max(least, key=lambda row: abs(off[row]))
        return float(measured[worst]), float(off[worst])

    def tested(self, effect: Effect | None, fit: Fit) -> Refit:
        """Test on the held-out data; errors are root mean squares in standard deviations.

        If the residual exceeds the standard deviations of the features, these are too small by a common factor, and the
        covariance of the fit is scaled accordingly.
        """
        try:
            residual = self.held_out.residual(self.held_out.predict(fit.model))
        except (CampaignError, ModelError):
            residual = np.full(len(self.held_out.measured), NOT_FOUND)
        squares = [float(np.mean(item**2)) for item in (fit.residual[: fit.n_number], residual)]
        n_free = int(np.isinf(fit.unknowns.prior).sum())
        excess = max(1.0, fit.chi2 / max(fit.n_number - n_free, 1))
        wide = replace(fit, covariance=excess * fit.covariance)
        return Refit(
            effect=effect, fit=wide, held_out_reduced_chi2=squares[1], n_held_out=len(residual),
            error=squares[0] ** 0.5, held_out_error=squares[1] ** 0.5,
        )  # fmt: skip

    def test_uncalibrated(self, model: Model) -> Refit:
        """The same test of an uncalibrated model."""
        return self.tested(None, self.fit.with_model(self.train, model, self.train.predict(model)))


def arrange_features(
    base: Model,
    data: Sequence[Datum],
    calibration: Sequence[CalibrationParameter],
    *,
    added: Sequence[AddedEffect] = (),
) -> FeatureArrangement:
    """Fit the calibration parameters and the added effects.

    Parameters
    ----------
    base
        Model without the added effects, with the sensors of the data.
    data
        Data; if none is held out, every third datum tests the fit, and a single datum tests itself.
    calibration
        Calibration parameters.
    added
        Effects added in earlier rounds.

    Raises
    ------
    CampaignError
        The model lacks something that the data refer to, or all data are held out.
    """
    fitted, tested = split_data(data)
    if not fitted:
        raise CampaignError("all data are held out: leave some to fit")
    train = FeatureComparison.from_data(fitted)
    unknowns = make_unknowns(base, calibration, [item.effect for item in added])
    fit = calibrate(train, unknowns, make_first_values(unknowns, added), train.predict(base), ending=Ending.EXACT)
    return FeatureArrangement(
        base=base, calibration=tuple(calibration), added=tuple(added), train=train,
        held_out=FeatureComparison.from_data(tested), fit=fit,
    )  # fmt: skip


def split_data(data: Sequence[Datum]) -> tuple[list[Datum], list[Datum]]:
    """Training data, and data that test the fit: the held-out ones, or every third; a single datum is both."""
    fitted, tested = ([item for item in data if item.held_out is side] for side in (False, True))
    if tested or len(data) < 2:
        return fitted, tested or list(data)
    tests = [number % EVERY == 1 for number in range(len(data))]
    fitted, tested = ([item for item, test in zip(data, tests, strict=True) if test is side] for side in (False, True))
    return fitted, tested
