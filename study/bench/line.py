"""Predicted lines of a comparison with their derivatives by the parameters, and exact lines at other parameters."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, name_configuration
from correlation.feature.observation import find_sweep_directions
from correlation.metric.misfit import Misfit
from correlation.prediction import Points, Prediction, Predictor
from diagnosis.fit.fit_parameter import Unknowns, Values
from diagnosis.fit.tangent import differentiate
from fe.blas_threads import on_one_blas_thread
from geometry.errors import InputError
from pipeline.store import stage
from study.case.setup import Setup
from study.compare.curve import LINE_TOLERANCE, join_sides, refine_points
from study.compare.result import ComparisonResult
from study.compare.unknown_gain import set_gains

#: Step of the finite difference for a parameter without analytical derivatives, as a fraction of its typical size [-].
STEP = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class Lines:
    """Lines of one configuration, at the values of the case.

    Parameters
    ----------
    prediction
        Coefficients and states at the points of the lines, shape (k,).
    slopes
        Derivatives of the coefficients with respect to the parameters, shape (k, p); NaN without a state.
    """

    prediction: Prediction
    slopes: Complex[NDArray[np.complex128], "k p"]

    @property
    def points(self) -> Points:
        """Points of the lines."""
        return self.prediction.points


def list_unknowns(setup: Setup, campaign: Campaign) -> tuple[Unknowns, Values]:
    """List the parameters that can be changed, and their values in the case, shape (p,).

    Parameters
    ----------
    setup
        Set-up of the case, with the sensors of the campaign.
    campaign
        Campaign whose unknown gains are fitted first.
    """
    return list_case_unknowns(set_gains(setup, campaign).setup)


def list_case_unknowns(setup: Setup) -> tuple[Unknowns, Values]:
    """List the parameters of a case whose gains are known, and their values, shape (p,)."""
    effects = [item.effect for item in setup.added]
    calibration = [(item, item.deviation) for item in setup.calibration_parameters]
    unknowns = Unknowns.from_effects(setup.model, calibration, effects)
    values = [setup.calibrated.get(item.name, 1.0) for item in setup.calibration_parameters]
    values += [float(value) for item in setup.added for value in item.values]
    return unknowns, np.array(values, dtype=np.float64)


def move_values(unknowns: Unknowns, values: Values, given: Mapping[str, float], case: Path) -> Values:
    """Replace some values of the parameters of a case, shape (p,).

    Raises
    ------
    InputError
        The case does not have such a parameter.
    """
    moved = np.array(values)
    for name, value in given.items():
        if name not in unknowns.names:
            raise InputError(f'"{name}" is not a parameter of {case}: there are {", ".join(unknowns.names)}')
        moved[unknowns.names.index(name)] = value
    return moved


@stage("lines that move", ignore=("compared", "unknowns", "values"))
def find_lines(key: str, compared: ComparisonResult, unknowns: Unknowns, values: Values) -> dict[str, Lines]:
    """Compute the lines of each configuration, "free" and "jointed", with their slopes; the key is the comparison's."""
    del key
    return {
        name_configuration(free): _compute_lines(predictor, compared.prediction, unknowns, values)
        for free, predictor in make_predictors(compared).items()
    }


def make_predictors(compared: ComparisonResult) -> dict[bool, Predictor]:
    """Make the predictor of the lines of each configuration, by whether the contacts are absent."""
    everything, _ = join_sides(compared.train, compared.held_out)
    sweeps, result = find_sweep_directions(compared.campaign), {}
    for free in np.unique(everything.points.free):
        points = refine_points(everything.where(np.asarray(everything.points.free == free)).points)
        swept = sweeps if points.sweep.any() else ()
        result[bool(free)] = Predictor(points=points, sweeps=swept, tolerance=LINE_TOLERANCE)
    return result


@on_one_blas_thread
def move_lines(
    compared: ComparisonResult, lines: Mapping[str, Lines], unknowns: Unknowns, values: Values
) -> dict[bool, tuple[Points, Complex[NDArray[np.complex128], " k"]]]:
    """Compute exact lines at other values of the parameters, by whether the contacts are absent."""
    model = unknowns.compose(unknowns.clipped(values))
    result = {}
    for free, predictor in make_predictors(compared).items():
        before = lines[name_configuration(free)].prediction
        result[free] = predictor.points, predictor.vary(model, before)
    return result


def at_measured(misfit: Misfit, points: Points, line: Complex[NDArray[np.complex128], " k"]) -> Misfit:
    """Replace the predictions of a misfit at all points of a line; other predictions are unchanged."""

    def rows(points: Points) -> list[tuple[bool, float, float, str, int, int]]:
        columns = (points.free, points.level, points.frequency, points.sensor, points.harmonic, points.sweep)
        return list(zip(*(column.tolist() for column in columns), strict=True))

    result = dict(zip(rows(points), line.tolist(), strict=True))
    value = [result.get(row, old) for row, old in zip(rows(misfit.points), misfit.predicted.tolist(), strict=True)]
    predicted = np.array(value, dtype=np.complex128)
    # The reading of a sensor without a phase is a modulus.
    modulus = ~misfit.phased & (misfit.points.harmonic > 0)
    return replace(misfit, predicted=np.where(modulus, np.abs(predicted), predicted))


def _compute_lines(predictor: Predictor, near: Prediction, unknowns: Unknowns, values: Values) -> Lines:
    model = unknowns.compose(values)
    prediction = predictor.predict(model, near)
    changes = differentiate(unknowns.compose, values, unknowns.size, unknowns.bounds)
    slopes = np.full((len(predictor.points), len(changes)), np.nan, dtype=np.complex128)
    known = [change for change in changes if change is not None]
    if known:
        slopes[:, [change is not None for change in changes]] = predictor.derivatives(model, prediction, known)
    for number, change in enumerate(changes):
        if change is None:
            moved, step = unknowns.neighbour(values, number, STEP)
            slopes[:, number] = (predictor.vary(moved, prediction) - prediction.value) / step
    return Lines(prediction=prediction, slopes=slopes)
