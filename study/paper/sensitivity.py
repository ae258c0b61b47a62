"""Sensitivities of response and force limits around iteration 3 to a step of each parameter."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.family.family import Family
from diagnosis.fit.family_fit import MapOver
from diagnosis.fit.family_target import sample_bands
from pipeline.store import stage
from study.paper.model import ModelInputs, PaperModel
from study.paper.parameters import RigParameters


@dataclass(frozen=True, kw_only=True, eq=False)
class Sensitivity:
    """Changes due to a step down and up of each parameter.

    Parameters
    ----------
    names
        Parameters.
    upper, lower
        Change of the highest point of the upper and of the lower limit of the response, shape (p, 2) [-].
    frequency
        Change of the frequency of the highest point of the upper limit, shape (p, 2) [-].
    normal, tangential
        Change of the middle of the limits of the static normal and tangential force of the left side, over the static
        normal force, shape (p, 2) [-].
    level
        Level of all of them [N].
    """

    names: tuple[str, ...]
    upper: Float[NDArray[np.float64], "p 2"]
    lower: Float[NDArray[np.float64], "p 2"]
    frequency: Float[NDArray[np.float64], "p 2"]
    normal: Float[NDArray[np.float64], "p 2"]
    tangential: Float[NDArray[np.float64], "p 2"]
    level: float


@stage("sensitivities of the limits", ignore=("make", "report", "map_over"))
def compute_sensitivities(
    inputs: ModelInputs,  # noqa: ARG001 - what is stored depends on it, and `make` cannot be looked into
    parameters: RigParameters,
    steps: Mapping[str, float],
    families: Sequence[Family],
    frequency: Float[NDArray[np.float64], " f"],
    level: float,
    make: PaperModel,
    report: Callable[[float, float], None] | None = None,
    map_over: MapOver = map,
) -> Sensitivity:
    """Sensitivities by differences of the bands of the same friction histories.

    Parameters
    ----------
    inputs
        What the models depend on.
    parameters
        Where the differences are taken.
    steps
        Step of each parameter by name [unit of the parameter].
    families
        Families of the response and of the static forces of the left side.
    frequency
        Frequencies of the bands, ascending, shape (f,) [Hz].
    level
        Level of the bands [N].
    make
        Makes the model of some parameters.
    report
        Progress.
    map_over
        `map`, or one over processes.
    """
    at_level = [family for family in families if family.level == level]
    compute = partial(_compute_peaks_and_forces, make, at_level, frequency, level)
    points = [parameters]
    for name, step in steps.items():
        for signed in (-step, step):
            value = getattr(parameters, name) + signed
            # A gap can only grow.
            points.append(replace(parameters, **{name: max(value, 0.0) if name == "gap_angle" else value}))
    computed = []
    for numbers in map_over(compute, points):
        computed.append(numbers)
        if report is not None:
            report(len(computed), len(points))
    here = computed[0]
    changes = np.reshape(computed[1:], (len(steps), 2, 5)) - here
    size = np.array([here[0], here[1], here[2], here[3], here[3]])
    upper, lower, shift, normal, tangential = np.moveaxis(changes / size, -1, 0)
    return Sensitivity(
        names=tuple(steps), upper=upper, lower=lower, frequency=shift, normal=normal, tangential=tangential, level=level
    )


def _compute_peaks_and_forces(
    make: PaperModel, families: Sequence[Family], frequency: Float[NDArray[np.float64], " f"], level: float,
    parameters: RigParameters,
) -> Float[NDArray[np.float64], "5"]:  # fmt: skip
    """Peaks of both response limits, frequency of the upper, static normal and tangential force of the left side."""
    bands = sample_bands(make(parameters), families, frequency)
    tip = bands["tip", 1, level]
    highest = np.nanmax(tip.value, axis=1)
    at = int(np.nanargmax(tip.value[1]))
    # A parabola through the highest point and its neighbours resolves less than a step of the grid.
    near = slice(max(at - 1, 0), at + 2)
    f, y = tip.frequency[near], tip.value[1, near]
    peak = float(tip.frequency[at])
    if len(f) == 3:
        a, b, _ = np.polyfit(f - peak, y, 2)
        peak -= float(b / (2 * a)) if a < 0 else 0.0
    forces = [bands[f"left_decoupler_{letter}", 0, level].value[:, at].mean() for letter in "NT"]
    return np.array([highest[1], highest[0], peak, *forces])
