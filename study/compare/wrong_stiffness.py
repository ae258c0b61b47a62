"""Gross misfits of a model, and stiffnesses of a case in another unit than meant that explain them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.campaign.measurement import Suspicion
from correlation.model import Model
from correlation.prediction import Points, Predictor
from fe.dense_modes import compute_dense_modes
from reduction.errors import JointError
from reduction.stuck import stick_at_rest

#: Residual of predicted motions relative to the linear ones: wrong units, signs and sensors are gross [-].
ROUGH = 1e-4
#: Motions that are off by this much are asked for with another level or stiffness, and what is left where that is
#: right (medians of the natural logarithm) [-].
GROSS, MENDED = 0.7, 0.2
#: What is left where another stiffness is right: other errors of a case that is right but for a unit [-]. Of 140 random
#: chains with two contacts, 0 of the 55 that are grossly off by stiffnesses wrong by up to a factor of 50 look like one
#: in another unit, and 46 of the 51 that are off by a unit do.
AGREES = 0.1
#: Powers of ten between N/m, N/mm and N/um.
POWERS = (-3, 3, -6, 6)
STIFFNESS = "N/m"
#: Share of the misfit with half the power that is left with all of it: a contact that hardly moves is as good with
#: either, which then tells nothing of a unit. Share of the distance of the resonance as well [-].
TOLD = 0.5
#: Changes whose resonance is nearest, for which steady states are computed.
MOST_TRIED = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Readings:
    """Some readings of motions.

    Parameters
    ----------
    points
        Where, m of them.
    value
        Mean of the repeats, shape (m,) [SI].
    """

    points: Points
    value: Complex[NDArray[np.complex128], " m"]

    def misfit(self, prediction: Complex[NDArray[np.complex128], " m"]) -> float:
        """Median natural logarithm between them and a prediction of most of them [-]; infinite without one."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs(np.log(np.abs(self.value) / np.abs(prediction)))
        there = np.isfinite(ratio)
        return float(np.median(ratio[there])) if 2 * there.sum() > len(ratio) else np.inf

    def misfit_of(self, model: Model) -> float:
        """The same for a model."""
        return self.misfit(Predictor(points=self.points, tolerance=ROUGH).predict(model).value)


def find_wrong_stiffness(readings: Readings, stated: float, peak: float, model: Model) -> tuple[Suspicion, ...]:
    """The stiffness of a line, of all lines or of a joint that mends a gross misfit by a factor between two units.

    Parameters
    ----------
    readings
        Few readings: models that are tried are asked for all of them.
    stated
        Misfit of the case's model there [-].
    peak
        Frequency of a measured resonance at the lowest level, where contacts hardly slip [Hz].
    model
        The case's.
    """
    if not stated > GROSS:
        return ()
    nearest = _distance(model, peak)
    tried = [
        (distance, where, parameter, stiffness, power)
        for where, parameter, stiffness in _stiffnesses(model)
        for power in POWERS
        if (distance := _distance(_changed(model, parameter, stiffness, 10.0**power), peak)) < TOLD * nearest
    ]
    for _, where, parameter, stiffness, power in sorted(tried, key=lambda item: item[0])[:MOST_TRIED]:
        left = _misfit(readings, _changed(model, parameter, stiffness, 10.0**power))
        if not left < AGREES:
            continue
        between = 10.0 ** (power / 2)
        half = _misfit(readings, _changed(model, parameter, stiffness, between))
        if left < TOLD * half:
            sentence = (
                f"the model is off by a factor of {np.exp(stated):.3g}; with {parameter} {10.0**power:g} times that of "
                f"the case it agrees within {np.expm1(left):.1%} (medians), and with {between:.3g} times it is off by "
                f"a factor of {np.exp(half):.3g}: check its unit (1 N/um is 1000 N/mm, or 1e6 N/m)"
            )
            return (Suspicion(where=where, sentence=sentence),)
    return ()


def _distance(model: Model | None, peak: float) -> float:
    """Natural logarithm between a frequency and the nearest resonance with all contacts stuck [-]."""
    if model is None:
        return np.inf
    system = model.system
    frequency = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints)).frequency
    return float(np.abs(np.log(frequency[frequency > 0] / peak)).min(initial=np.inf))


def _misfit(readings: Readings, model: Model | None) -> float:
    return np.inf if model is None else readings.misfit_of(model)


def _stiffnesses(model: Model) -> Iterator[tuple[str, str, dict[str, float]]]:
    """Place in words, name of the parameter, and its value by joint, of every stiffness that a case gives [N/m]."""
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


def _changed(model: Model, parameter: str, stiffness: dict[str, float], factor: float) -> Model | None:
    """The model with so many times a stiffness; None where the law refuses it."""
    try:
        return model.with_joints({name: {parameter: factor * value} for name, value in stiffness.items()})
    except JointError:
        return None
