"""Sentences of a verdict, and words for the change of the held-out error by an effect."""

from collections.abc import Sequence

import numpy as np

from diagnosis.decision.law_of_force import FittedLaw
from diagnosis.decision.residual_explanation import ResidualExplanation
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.unknown_force import compute_excess_gain
from geometry.plain_number import format_number


def claim(effects: Sequence[Refit], strengths: Sequence[str], chances: Sequence[str], joint: str) -> str:
    """Beginning of a sentence: effects are missing, or the quantities that they scale differ from the case.

    Parameters
    ----------
    effects
        Fits with one effect each, one or more.
    strengths, chances
        Words for the strength of each, and an addition such as "probability 60 %" or an empty string.
    joint
        "and" or "or".
    """
    named = [
        f"{item.name} ({', '.join(filter(None, words))})"
        for item, *words in zip(effects, strengths, chances, strict=True)
    ]
    if not any(map(_is_ratio, effects)):
        verb = "are" if joint == "and" and len(effects) > 1 else "is"
        return _begin(f"{f' {joint} '.join(named)} {verb} missing", effects[0])
    clauses = [
        f"{item.name} is {strength}{f' ({chance})' if chance else ''} times as large as the case says"
        if _is_ratio(item)
        else f"{name} is missing"
        for item, name, strength, chance in zip(effects, named, strengths, chances, strict=True)
    ]
    return _begin(f", {joint} ".join(clauses), effects[0])


def _is_ratio(refit: Refit) -> bool:
    """Whether an effect is a factor on a value of the case."""
    assert refit.effect is not None
    return refit.effect.parameters[0].unit == "-" and refit.effect.parameters[0].vanishes == 1.0


def _begin(text: str, refit: Refit) -> str:
    """Sentence that begins with an effect, in upper case unless it begins with a name of the case."""
    assert refit.effect is not None
    if refit.name.startswith(refit.effect.kind):
        return text[0].upper() + text[1:]
    return f"{'The value of' if _is_ratio(refit) else 'The effect'} {text}"


def describe_law(refit: Refit, law: FittedLaw, baseline: Refit) -> str:
    """Sentence about an unknown force at the place of an effect, with its law."""
    falls = describe_held_out_fall(baseline, law.refit)
    return (
        f"Something is missing, and it is none of the known effects: near {refit.place}, {law.words}; with it {falls}. "
        f"The nearest known effect is {refit.name}."
    )


def describe_stand_in(name: str, residual: ResidualExplanation, thresholds: Thresholds) -> str:
    """Sentence about an effect that stands in for the cause, and the explanation of its residual."""
    unknown = compute_excess_gain(residual.places[0]) - thresholds.misfit if residual.places else -np.inf
    if residual.gain - thresholds.gain > unknown:
        return (
            f"Something is missing, and no known effect alone explains it: {name} explains most, and "
            f"{residual.effect_name} much of the residual."
        )
    left = residual.places[0].sentence
    return (
        f"Something is missing, and it is none of the known effects: {name} explains most, and a residual remains: "
        f"{left}."
    )


def describe_held_out_error(baseline: Refit) -> str:
    """Sentence about a large held-out error, with the training error for comparison."""
    held_out, others = (f"{format_number(100 * error)} %" for error in (baseline.held_out_error, baseline.error))
    if baseline.reduced_chi2_by_noise > UNEXPLAINED_CHI2:
        return (
            f"Something is missing, and no known effect explains it: the error of the calibrated model is {held_out} "
            f"on the held-out data and {others} on the training data."
        )
    return (
        f"Something is missing that only the held-out data show: the model error is {held_out} there and {others} on "
        "the training data, in which nothing is missing. Hold out other data, so that these are fitted."
    )


def describe_held_out_fall(before: Refit, after: Refit) -> str:
    """Change of the held-out error by an effect, in words; for each record if there are records."""
    if not after.held_out_names:
        chi2 = before.held_out_reduced_chi2_by_noise, after.held_out_reduced_chi2_by_noise
        return describe_held_out_change((before.held_out_error, after.held_out_error), chi2)
    change = ", ".join(
        f"{_format_percent(was)} to {_format_percent(now)} % in {name}"
        for was, now, name in zip(before.held_out_errors, after.held_out_errors, after.held_out_names, strict=True)
    )
    return f"the held-out error {'falls' if after.held_out_error < before.held_out_error else 'goes'} from {change}"


def describe_held_out_change(error: tuple[float, float], reduced_chi2: tuple[float, float]) -> str:
    """Change of the held-out error in words; of the reduced chi-squared if the error does not fall.

    Parameters
    ----------
    error, reduced_chi2
        Each without an effect, and with it [-].
    """
    was, now = map(_format_percent, error)
    if error[1] < error[0] and now != was:
        return f"the held-out error falls from {was} to {now} %"
    stays = f"stays {now} %" if now == was else f"goes from {was} to {now} %"
    stays = stays if np.isfinite(error).all() else "is unknown"
    was, now = (format_number(item, 3) for item in reduced_chi2)
    verb = "falls" if reduced_chi2[1] < reduced_chi2[0] else "rises"
    change = f"stays at {now}" if now == was else f"{verb} from {was} to {now}"
    return f"the held-out reduced chi-squared {change} (the held-out error {stays})"


def _format_percent(share: float) -> str:
    return format_number(100 * share, 3)
