"""Fits with a model error whose size is estimated with the parameters, in turn, until both are the most probable."""

from collections.abc import Sequence

from correlation.model import Model
from correlation.noise.error_size import NO_ERROR, ErrorSize
from correlation.prediction import Prediction
from diagnosis.fit.calibration import Ending, Fit, Matrix, calibrate, recalibrate
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.controlled_start import fit_under_control
from diagnosis.fit.fit_parameter import Unknowns, Values
from diagnosis.fit.weighting import allow_model_error, downweight_higher_levels, update_model_error

#: Rounds of fit and size of the model error, and the change of the sizes that ends them [-].
ROUNDS, SETTLED = 6, 0.1
#: Reduced chi-squared beyond which a calibration may have missed the minimum.
MAX_CALIBRATION_CHI2 = 1.5


def fit_from_scratch(
    comparison: Comparison, unknowns: Unknowns, values: Values, model: Model, prediction: Prediction, usual: float
) -> tuple[Comparison, Fit]:
    """Fit from start values, and the comparison with the model error that it leaves.

    The fit begins without model error. Where it ends badly, others begin with the error of the start, so that they need
    not explain what they cannot. The most probable one is taken: by contacts that slip, each may end in a minimum that
    is not the least.
    """
    plain = allow_model_error(comparison, model, prediction, usual)
    if not usual:
        return plain, _calibrated(plain, unknowns, values, prediction)
    fit = calibrate(plain, unknowns, values, prediction, ending=Ending.QUICK)
    result = [alternate(plain, fit)]
    if fit.chi2 > MAX_CALIBRATION_CHI2 * fit.n_number:
        wide = update_model_error(plain, prediction)
        begins = [values] if get_error_size(wide) != NO_ERROR else []
        begins.append(fit_under_control(comparison, unknowns, values, usual).fit.values)
        result += [alternate(wide, calibrate(wide, unknowns, item, prediction, ending=Ending.QUICK)) for item in begins]
    return _finish_most_probable(result)


def fit_from_fit(comparison: Comparison, fit: Fit, usual: float) -> tuple[Comparison, Fit]:
    """Fit that begins where another one ended, and the comparison with the model error that it leaves.

    One begins without model error, and one with that of the start, so that it need not explain what it cannot. The more
    probable one is taken.
    """
    unknowns, values, prediction = fit.unknowns, fit.values, fit.prediction
    plain = allow_model_error(comparison, fit.model, prediction, usual)
    if not usual:
        return plain, _calibrated(plain, unknowns, values, prediction)
    # A quick fit may end above its minimum.
    result = [alternate(plain, recalibrate(plain, fit))]
    wide = update_model_error(plain, prediction)
    if get_error_size(wide) != NO_ERROR:
        result.append(alternate(wide, recalibrate(wide, fit, ending=Ending.QUICK)))
    return _finish_most_probable(result)


def _finish_most_probable(fits: Sequence[tuple[Comparison, Fit]]) -> tuple[Comparison, Fit]:
    """The fit of the least -2 ln p by its own covariance, brought to its minimum."""
    comparison, fit = min(fits, key=lambda pair: pair[1].chi2 + pair[0].log_weight)
    if get_error_size(comparison) == NO_ERROR:
        return comparison, _calibrated(comparison, fit.unknowns, fit.values, fit.prediction)
    return comparison, recalibrate(comparison, fit, slopes=fit.jacobian, ending=Ending.EXACT)


def alternate(comparison: Comparison, fit: Fit) -> tuple[Comparison, Fit]:
    """Size of the model error and quick fit in turn, by which -2 ln p of both falls, until neither changes."""
    for _ in range(ROUNDS):
        resized = update_model_error(comparison, fit.prediction)
        if get_error_size(resized).is_near(get_error_size(comparison), SETTLED):
            break
        slopes, comparison = reweigh_slopes(fit, comparison, resized), resized
        fit = recalibrate(comparison, fit, slopes=slopes, ending=Ending.QUICK)
    return comparison, fit


def reweigh_slopes(fit: Fit, before: Comparison, after: Comparison) -> Matrix:
    """Jacobian of a fit by another covariance of the same predictions, shape (m + p, p)."""
    return fit.reweigh(lambda slopes: after.whitening(before.whitening.unwhiten(slopes)))


def get_error_size(comparison: Comparison) -> ErrorSize:
    """Size of the model error in a comparison."""
    return NO_ERROR if comparison.model_error is None else comparison.model_error.size


def _calibrated(
    comparison: Comparison,
    unknowns: Unknowns,
    values: Values,
    prediction: Prediction,
) -> Fit:
    """First fit; where it may have missed the minimum, a second one starts from a fit to the lowest level alone.

    Where a resonance is off by several of its widths, contacts slip in the model at frequencies at which they stick in
    the test, and friction parameters make up for it. At the lowest level the model is almost linear and shows where the
    resonance is. A missing effect makes a fit bad as well; both starts then end alike.
    """
    fit = calibrate(comparison, unknowns, values, prediction, ending=Ending.EXACT)
    if fit.chi2 <= MAX_CALIBRATION_CHI2 * fit.n_number:
        return fit
    second = fit_from_lowest_level(comparison, unknowns, values, prediction)
    return min(fit, second, key=lambda item: item.chi2)


def fit_from_lowest_level(
    comparison: Comparison, unknowns: Unknowns, values: Values, prediction: Prediction, ending: Ending = Ending.EXACT
) -> Fit:
    """Fit that begins where one to the lowest level alone ends; both end alike."""
    near = calibrate(downweight_higher_levels(comparison), unknowns, values, prediction, ending=ending)
    return recalibrate(comparison, near, ending=ending)
