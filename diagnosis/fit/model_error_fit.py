"""Fits in which parameters and size of the model error are estimated alternately, until both are most probable."""

from collections.abc import Sequence

from correlation.model import Model
from correlation.noise.error_size import NO_ERROR, ErrorSize
from correlation.prediction import Prediction
from diagnosis.fit.calibration import Ending, Fit, Matrix, calibrate, recalibrate
from diagnosis.fit.comparison import Comparison
from diagnosis.fit.controlled_start import fit_under_control
from diagnosis.fit.fit_parameter import Unknowns, Values
from diagnosis.fit.weighting import allow_model_error, downweight_higher_levels, update_model_error

#: Largest number of alternations of fit and model error, and relative change of its sizes that ends them [-].
ROUNDS, SETTLED = 6, 0.1
#: Reduced chi-squared beyond which a calibration may have missed the minimum.
MAX_CALIBRATION_CHI2 = 1.5


def fit_from_scratch(
    comparison: Comparison, unknowns: Unknowns, values: Values, model: Model, prediction: Prediction, usual: float
) -> tuple[Comparison, Fit]:
    """Fit from start values, and the comparison with its model error.

    The fit starts without model error. If its chi^2 is large, further fits start with the model error at the start
    values, so that the parameters do not absorb residuals that they cannot explain. The most probable fit is taken,
    since with slipping contacts each may end in a local minimum.
    """
    plain = allow_model_error(comparison, model, prediction, usual)
    if not usual:
        return plain, _calibrate_first(plain, unknowns, values, prediction)
    fit = calibrate(plain, unknowns, values, prediction, ending=Ending.QUICK)
    result = [alternate(plain, fit)]
    if fit.chi2 > MAX_CALIBRATION_CHI2 * fit.n_number:
        wide = update_model_error(plain, prediction)
        begins = [values] if get_error_size(wide) != NO_ERROR else []
        begins.append(fit_under_control(comparison, unknowns, values, usual).fit.values)
        result += [alternate(wide, calibrate(wide, unknowns, item, prediction, ending=Ending.QUICK)) for item in begins]
    return _finish_most_probable(result)


def fit_from_fit(comparison: Comparison, fit: Fit, usual: float) -> tuple[Comparison, Fit]:
    """Fit continued from another one, and the comparison with its model error.

    One fit starts without model error, a second one with the model error at the start values, see `fit_from_scratch`.
    The more probable one is taken.
    """
    unknowns, values, prediction = fit.unknowns, fit.values, fit.prediction
    plain = allow_model_error(comparison, fit.model, prediction, usual)
    if not usual:
        return plain, _calibrate_first(plain, unknowns, values, prediction)
    # A quick fit may stop above its minimum.
    result = [alternate(plain, recalibrate(plain, fit))]
    wide = update_model_error(plain, prediction)
    if get_error_size(wide) != NO_ERROR:
        result.append(alternate(wide, recalibrate(wide, fit, ending=Ending.QUICK)))
    return _finish_most_probable(result)


def _finish_most_probable(fits: Sequence[tuple[Comparison, Fit]]) -> tuple[Comparison, Fit]:
    """The fit with the lowest -2 ln p, each with its own covariance, converged to its minimum."""
    comparison, fit = min(fits, key=lambda pair: pair[1].chi2 + pair[0].log_weight)
    if get_error_size(comparison) == NO_ERROR:
        return comparison, _calibrate_first(comparison, fit.unknowns, fit.values, fit.prediction)
    return comparison, recalibrate(comparison, fit, slopes=fit.jacobian, ending=Ending.EXACT)


def alternate(comparison: Comparison, fit: Fit) -> tuple[Comparison, Fit]:
    """Estimate the model error and refit alternately, which lowers -2 ln p, until the model error is stationary."""
    for _ in range(ROUNDS):
        resized = update_model_error(comparison, fit.prediction)
        if get_error_size(resized).is_near(get_error_size(comparison), SETTLED):
            break
        slopes, comparison = reweigh_slopes(fit, comparison, resized), resized
        fit = recalibrate(comparison, fit, slopes=slopes, ending=Ending.QUICK)
    return comparison, fit


def reweigh_slopes(fit: Fit, before: Comparison, after: Comparison) -> Matrix:
    """Jacobian of a fit with another covariance of the same predictions, shape (m + p, p)."""
    return fit.reweigh(lambda slopes: after.whitening(before.whitening.unwhiten(slopes)))


def get_error_size(comparison: Comparison) -> ErrorSize:
    """Size of the model error in a comparison."""
    return NO_ERROR if comparison.model_error is None else comparison.model_error.size


def _calibrate_first(
    comparison: Comparison,
    unknowns: Unknowns,
    values: Values,
    prediction: Prediction,
) -> Fit:
    """Fit; if it may have missed the minimum, a second one starts from a fit to the lowest level alone.

    If a resonance is shifted by several of its widths, contacts slip in the model at frequencies at which they stick in
    the test, and the friction parameters compensate for this. At the lowest level the model is almost linear and the
    resonance can be located. A missing effect also causes a poor fit; both starts then lead to the same minimum.
    """
    fit = calibrate(comparison, unknowns, values, prediction, ending=Ending.EXACT)
    if fit.chi2 <= MAX_CALIBRATION_CHI2 * fit.n_number:
        return fit
    second = fit_from_lowest_level(comparison, unknowns, values, prediction)
    return min(fit, second, key=lambda item: item.chi2)


def fit_from_lowest_level(
    comparison: Comparison, unknowns: Unknowns, values: Values, prediction: Prediction, ending: Ending = Ending.EXACT
) -> Fit:
    """Fit started from a fit to the lowest level alone; `ending` applies to both."""
    near = calibrate(downweight_higher_levels(comparison), unknowns, values, prediction, ending=ending)
    return recalibrate(comparison, near, ending=ending)
