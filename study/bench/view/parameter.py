"""View of the parameters of a case: priors, intervals, bounds, and the ranges of their sliders on the page."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.candidate.effect import EffectParameter
from diagnosis.fit.fit_parameter import Unknowns, Values
from study.case.added import format_parameter
from study.case.setup import Setup
from study.diagnose.history import History
from study.diagnose.table import format_interval, split_unit

#: Largest distance of a value at a bound, as a fraction of the range [-].
AT_BOUND = 1e-3
#: Half range of a slider: in standard deviations of the prior, or without a prior as a fraction of the value [-].
PRIOR_HALF_RANGE, FREE_HALF_RANGE = 3.0, 1.0


def show_parameters(setup: Setup, unknowns: Unknowns, values: Values, history: History) -> list[dict[str, Any]]:
    """Make the rows of the table of parameters, those at a bound first.

    Parameters
    ----------
    setup
        Set-up of the case.
    unknowns, values
        Parameters, and their values in the case, shape (p,).
    history
        History of the case, with the intervals of fitted values.
    """
    noted = _list_noted(history)
    physics = [item.physics for item in setup.calibration_parameters]
    physics += [item.effect.physics for item in setup.added for _ in item.effect.parameters]
    is_effect = [number >= len(setup.calibration_parameters) for number in range(len(values))]
    rows = [
        _show_row(number, name, parameter, float(value), float(prior), noted, of_effect) | {"physics": text}
        for number, (name, parameter, value, prior, of_effect, text) in enumerate(
            zip(unknowns.names, unknowns.parameters, values, unknowns.prior, is_effect, physics, strict=True)
        )
    ]
    return sorted(rows, key=lambda row: not row["at_bound"])


def _show_row(
    number: int, name: str, parameter: EffectParameter, value: float, prior: float, noted: Mapping[str, str],
    of_effect: bool,
) -> dict[str, Any]:  # fmt: skip
    lower, upper = parameter.lower, parameter.upper
    size, unit = split_unit(value if value else parameter.typical, parameter)
    first, last = _choose_range(parameter, value, prior)
    return {
        "number": number,
        "name": name,
        "is_effect": of_effect,
        "value": value,
        "text": format_interval(value, 0.0, parameter),
        "interval": noted.get(name, ""),
        "prior": f"± {100 * prior:.3g} %" if np.isfinite(prior) else "none",
        "bounds": [format_parameter(bound, parameter, 3) if np.isfinite(bound) else "none" for bound in (lower, upper)],
        "at_bound": is_at_bound(value, parameter),
        "slider": {"first": first, "last": last, "step": (last - first) / 400, "size": size, "unit": unit},
    }


def is_at_bound(value: float, parameter: EffectParameter) -> bool:
    """Whether a value is at a bound of its parameter, within `AT_BOUND`."""
    bounds = [bound for bound in (parameter.lower, parameter.upper) if np.isfinite(bound)]
    width = bounds[1] - bounds[0] if len(bounds) == 2 else abs(parameter.typical - parameter.vanishes)
    return any(abs(value - bound) <= AT_BOUND * width for bound in bounds)


def _choose_range(parameter: EffectParameter, value: float, prior: float) -> tuple[float, float]:
    """Choose the range of a slider around a value, within the bounds."""
    if np.isfinite(prior):
        half = max(PRIOR_HALF_RANGE * prior, 1.5 * abs(value - 1))
        first, last = min(1.0, value) - half, max(1.0, value) + half
    else:
        half = FREE_HALF_RANGE * max(abs(value - parameter.vanishes), abs(parameter.typical - parameter.vanishes) / 2)
        first, last = value - half, value + half
    return max(first, parameter.lower), min(last, parameter.upper)


def _list_noted(history: History) -> dict[str, str]:
    """List half the 95 % interval of each value as text from the last fit, by name."""
    result: dict[str, str] = {}
    for step in history.active_steps:
        result |= {name: _note(pair) for name, pair in step.calibrated.items()}
        for key, pair in step.values.items():
            result |= {step.effect: _note(pair), f"{step.effect}, {key}": _note(pair)}
    return result


def _note(pair: Sequence[Any]) -> str:
    return str(pair[1]) if len(pair) > 1 else ""


def show_fitted(
    names: Sequence[str], parameters: Sequence[EffectParameter], values: Values, deviation: Values
) -> dict[str, Any]:
    """List value, interval, and whether it is at a bound, of each parameter of a fit, by name."""
    return {
        name: {
            "text": format_interval(float(value), float(one), parameter),
            "half": float(TWO_SIDED_95 * one),
            "value": float(value),
            "at_bound": is_at_bound(float(value), parameter),
        }
        for name, parameter, value, one in zip(names, parameters, values, deviation, strict=True)
    }
