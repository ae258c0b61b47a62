"""Stiffnesses of a case in a wrong unit, which explain a gross misfit."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import Suspicion
from correlation.model import Model
from reduction.errors import JointError
from study.compare.gross_misfit import GROSS, MotionReadings
from study.compare.visible_resonance import find_visible_resonances

#: Number of readings to detect a wrong stiffness: every tried model predicts all of them.
MOST_ASKED = 16
#: Largest remaining misfit with the correct unit, due to other errors of the case [-]. It is larger at sharp
#: resonances, so that half of the wrong units of random chains are found (`benchmarks.wrong_stiffness`).
AGREES = 0.1
#: Powers of ten between N/m, N/mm and N/um.
POWERS = (-3, 3, -6, 6)
STIFFNESS = "N/m"
#: Largest ratio of the misfit with the whole power of ten to that with half of it: at a contact that hardly moves both
#: fit alike, so that the unit is not identifiable. The same for the distance of the resonance [-].
DISTINGUISHABLE = 0.5
#: Number of changes with the nearest resonance for which steady states are computed.
MOST_TRIED = 2


def find_wrong_stiffness(motions: MotionReadings, model: Model) -> tuple[Suspicion, ...]:
    """The stiffness of a line, of all lines or of a joint that explains a gross misfit by a factor between two units.

    Parameters
    ----------
    motions
        Fundamentals of all motions of known size (`find_motions`).
    model
        Model of the case.
    """
    jointed = motions.where(~motions.points.free)
    readings = jointed.some(MOST_ASKED)
    stated = readings.stated_misfit
    if not stated > GROSS or (peak := _find_lowest_peak(jointed)) is None:
        return ()
    nearest = _compute_distance(model, peak)
    tried = [
        (distance, where, parameter, stiffness, power, changed)
        for where, parameter, stiffness in _list_stiffnesses(model)
        for power in POWERS
        if (distance := _compute_distance(changed := _change(model, parameter, stiffness, 10.0**power), peak))
        < DISTINGUISHABLE * nearest
    ]
    for _, where, parameter, stiffness, power, changed in sorted(tried, key=lambda item: item[0])[:MOST_TRIED]:
        left = readings.misfit_of(changed)
        if not left < AGREES:
            continue
        between = 10.0 ** (power / 2)
        half = readings.misfit_of(_change(model, parameter, stiffness, between))
        if left < DISTINGUISHABLE * half:
            sentence = (
                f"the model is off by a factor of {np.exp(stated):.3g}; with {parameter} {10.0**power:g} times that of "
                f"the case it agrees within {np.expm1(left):.1%} (medians), and with {between:.3g} times it is off by "
                f"a factor of {np.exp(half):.3g}: check its unit (1 N/um is 1000 N/mm, or 1e6 N/m)"
            )
            return (Suspicion(where=where, sentence=sentence),)
    return ()


def _find_lowest_peak(jointed: MotionReadings) -> float | None:
    """Frequency of the largest motion of one sensor at the lowest level, where contacts hardly slip [Hz].

    None if it is at an end of the band.
    """
    points = jointed.points
    lowest = np.flatnonzero(points.level == points.level.min(initial=np.inf))
    if not len(lowest):
        return None
    lowest = lowest[points.sensor[lowest] == points.sensor[lowest[0]]]
    frequency = points.frequency[lowest]
    peak = float(frequency[np.argmax(np.abs(jointed.value[lowest]))])
    return peak if frequency.min() < peak < frequency.max() else None


def _compute_distance(model: Model | None, peak: float) -> float:
    """Absolute log ratio of a frequency and the nearest resonance that the test can show [-]."""
    if model is None:
        return np.inf
    return float(np.abs(np.log(find_visible_resonances(model) / peak)).min(initial=np.inf))


def _list_stiffnesses(model: Model) -> Iterator[tuple[str, str, dict[str, float]]]:
    """Place in words, parameter name, and value by joint [N/m] of every stiffness of a case."""
    joints = {joint.name: joint for joint in model.system.joints}
    of_line = {name for contacts in model.lines.values() for name in contacts}
    groups = {f'line "{line}"': contacts for line, contacts in model.lines.items()}
    groups |= {f'joint "{name}"': (name,) for name in joints if name not in of_line}
    if len(model.lines) > 1:
        groups[f"lines {', '.join(model.lines)}"] = tuple(of_line)
    for where, names in groups.items():
        values: dict[str, dict[str, float]] = {}
        for name in names:
            for parameter in joints[name].parameters:
                if parameter.unit == STIFFNESS and not parameter.is_list:
                    values.setdefault(parameter.name, {})[name] = getattr(joints[name], parameter.name)
        for parameter_name, stiffness in values.items():
            yield where, parameter_name, stiffness


def _change(model: Model, parameter: str, stiffness: dict[str, float], factor: float) -> Model | None:
    """The model with a factor on a stiffness; None if the law refuses it."""
    try:
        return model.with_joints({name: {parameter: factor * value} for name, value in stiffness.items()})
    except JointError:
        return None
