"""Motion of a place, and the missing force at it, estimated from the readings."""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.model import DERIVATIVE, Model, Sensor
from diagnosis.candidate.place import is_parallel
from diagnosis.fit.comparison import Comparison
from diagnosis.missing_law.loaded_states import Response, StateTable

Row = Float[NDArray[np.float64], " r"]
Motion = Complex[NDArray[np.complex128], "s h"]

#: Relative cut-off of singular values in the equations of a state: for motion and force, and for the force alone [-].
RANK, FULL_RANK = 1e-2, 1e-8


def find_motion(
    train: Comparison, table: StateTable, model: Model, row: Row, response: Response
) -> tuple[Motion, Complex[NDArray[np.complex128], " s"]]:
    """Harmonics of the motion of the place in each state, shape (s, h) [m], and the missing force at the place [N].

    If a sensor measures the place, the fundamental follows from its reading. Otherwise it is that of the model, scaled
    and changed by a force at the place, with both fitted to the readings. The missing force is the best fit to the
    fundamentals of the readings.
    """
    motion = np.where(np.isfinite(response.motion[:, 0]), response.motion[:, 0], 0.0)
    missing = np.zeros(len(motion), dtype=np.complex128)
    points, value = train.features.points, response.value
    seen = (points.harmonic == 1) & train.observed.phased & np.isfinite(train.observed.value) & np.isfinite(value)
    deviation = train.whitening.deviation[: len(seen)]
    weight = np.where(seen, train.features.per_reading(train.observed.value)[: len(seen)] / deviation, 0.0)
    scale, omega = _list_scales(model, row), table.angular_frequency
    for number in range(len(table.keys)):
        at = np.flatnonzero((table.number == number) & seen)
        if not len(at):
            continue
        slopes, left = response.slopes[at, 0, 1] * weight[at, None], (train.observed.value - value)[at] * weight[at]
        parts = _solve_parts(slopes, left, FULL_RANK)
        missing[number] = parts[0] + 1j * parts[1]
        direct = [point for point in at if points.sensor[point] in scale]
        if direct:
            order, gain = scale[str(points.sensor[direct[0]])]
            turn = (1j * omega[number]) ** order * gain
            motion[number, 1] = train.observed.value[direct[0]] / turn
            continue
        own, force = motion[number, 1], response.receptance[number, 0]
        # Scaled to the size of the motion, so that indistinguishable parts are shared evenly.
        size = abs(own) / max(np.abs(force).max(), 1e-300)
        scaled = np.column_stack([value[at], 1j * value[at]]) * weight[at, None]
        parts = _solve_parts(np.column_stack([scaled, slopes * size]), left, RANK)
        motion[number, 1] += (parts[0] + 1j * parts[1]) * own + size * force @ parts[2:]
    return motion, missing


def _list_scales(model: Model, row: Row) -> dict[str, tuple[int, float]]:
    """For each sensor that measures the place: number of time derivatives, and reading per displacement."""
    sensors = [item for item in model.sensors if isinstance(item, Sensor) and not item.delay]
    return {
        item.name: (DERIVATIVE[item.quantity], item.gain * float(item.row @ row) / float(row @ row))
        for item in sensors
        if is_parallel(item.row, row)
    }


def _solve_parts(
    table: Complex[NDArray[np.complex128], "n p"], right: Complex[NDArray[np.complex128], " n"], rank: float
) -> Float[NDArray[np.float64], " p"]:
    """Real least-squares solution of complex equations, shape (p,)."""
    return np.asarray(
        np.linalg.lstsq(np.concatenate([table.real, table.imag]), np.concatenate([right.real, right.imag]), rcond=rank)[
            0
        ]
    )
