"""Doubts about a diagnosis, at the beginning of a report: parameters far from their priors, a harmful calibration."""

from collections.abc import Iterator
from math import isfinite

from diagnosis.decision.evidence import errs_on_held_out
from geometry.plain_number import format_number
from study.compare.report import describe_jump
from study.diagnose.round import Round

#: Distance from its prior beyond which a calibration parameter is in doubt [standard deviations].
DOUBTFUL_PRIOR_RESIDUAL = 3.0
#: A calibration is harmful above this rise of chi^2 of the held-out data (two standard deviations of one parameter), or
#: above this ratio of the held-out errors, whatever chi^2 is [-].
HARMFUL_CHI2_RISE, HARMFUL_ERROR_RATIO = 4.0, 2.0


def list_doubts(result: Round) -> list[str]:
    """Doubts in sentences, the gravest first.

    Parameters
    ----------
    result
        The round.
    """
    return [
        *map(str, result.wrong),
        *_doubt_unknown_errors(result),
        *_doubt_worse_held_out_data(result),
        *_doubt_remaining_error(result),
        *_doubt_jumps(result),
        *_doubt_shifted_parameters(result),
        *result.remarks,
    ]


def list_notes(result: Round) -> list[str]:
    """Notes that do not raise doubt, in sentences.

    Parameters
    ----------
    result
        The round.
    """
    return [*_model_error(result)]


def _doubt_unknown_errors(result: Round) -> Iterator[str]:
    """Relative errors that cannot be computed."""
    baseline = result.diagnosis.baseline
    if not (isfinite(baseline.error) and isfinite(baseline.held_out_error)):
        seen = result.diagnosis.arrangement.held_out.shares.any() and result.diagnosis.arrangement.train.shares.any()
        why = "the model has no steady state" if seen else "no motion exceeds the scatter between its repeats"
        yield f"The relative errors are unknown: {why}."


def _doubt_worse_held_out_data(result: Round) -> Iterator[str]:
    """A calibration that increases the held-out error, by chi^2 of noise and stated errors or clearly in itself."""
    uncalibrated, baseline = result.uncalibrated, result.diagnosis.baseline
    rise = (baseline.held_out_reduced_chi2_by_noise - uncalibrated.held_out_reduced_chi2_by_noise) * baseline.n_held_out
    larger = baseline.held_out_error / uncalibrated.held_out_error if uncalibrated.held_out_error else 1.0
    if larger > HARMFUL_ERROR_RATIO or (rise > HARMFUL_CHI2_RISE and larger > 1):
        what = "Calibration with the added effects" if result.setup.added else "Calibration"
        yield (
            f"{what} makes the held-out error worse: {format_number(100 * uncalibrated.held_out_error, 3)} % for the "
            f"nominal model, {format_number(100 * baseline.held_out_error, 3)} % with it."
        )


def _doubt_remaining_error(result: Round) -> Iterator[str]:
    """A large remaining held-out error with the named effect."""
    if result.best is not None and errs_on_held_out(result.best):
        held_out, others = (
            f"{format_number(100 * error)} %" for error in (result.best.held_out_error, result.best.error)
        )
        yield (
            f"With {result.best.label} the error of the model is still {held_out} on the held-out data ({others} on "
            "the training data): more is missing, or this effect stands in for another cause."
        )


def _doubt_jumps(result: Round) -> Iterator[str]:
    """Held-out jumps at another frequency in the model, or absent from it; the held-out error excludes them."""
    jumps = (result.best or result.diagnosis.baseline).held_out_jumps
    elsewhere = [
        jump for jump in jumps
        if not abs(jump.frequency_error) <= jump.frequency_deviation
        # A jump measured in one sweep only may be a steep flank.
        and (jump.swept_both_ways or isfinite(jump.predicted_frequency))
    ]  # fmt: skip
    if elsewhere:
        listed = "; ".join(describe_jump(jump, result.campaign.drive.unit) for jump in elsewhere)
        yield f"Jumps of the held-out data: {listed}."
        if any(isfinite(jump.frequency_error) for jump in elsewhere):
            yield (
                "Between a measured and a predicted jump the held-out error refers to the branch that the structure "
                "was on."
            )


def _doubt_shifted_parameters(result: Round) -> Iterator[str]:
    """Individual calibration parameters at a bound or far from their priors.

    The joint test of all of them against their priors is a rule of the verdict, see `list_beyond_priors`.
    """
    fit = (result.best or result.diagnosis.baseline).fit
    for value, parameter in zip(fit.values.tolist(), result.diagnosis.arrangement.calibration, strict=False):
        (factor,) = parameter.parameters
        residual = abs(value - factor.vanishes) / parameter.stated_deviation
        there = factor.describe(parameter.name, value)
        if factor.is_at_bound(value):
            yield f"{there} is at a bound of the fit: the cause may be something else."
        elif residual > DOUBTFUL_PRIOR_RESIDUAL:
            yield (
                f"{there} is {residual:.1f} standard deviations of its prior from the case: the cause may be something "
                "else."
            )


def _model_error(result: Round) -> Iterator[str]:
    """Estimated model error beyond the stated errors of the case, with the accepted effect or without any."""
    words = result.diagnosis.verdict.model_error_size.words
    if words:
        yield (
            f"Beyond noise and the errors stated in the case, the model has errors of {words} (standard deviations); "
            "intervals and thresholds include them."
        )
