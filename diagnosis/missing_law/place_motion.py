"""Motion of a place, and the missing force there, estimated from the readings."""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.model import DERIVATIVE, Model, Sensor
from diagnosis.candidate.place import is_parallel
from diagnosis.fit.comparison import Comparison
from diagnosis.missing_law.loaded_states import Response, StateTable

Row = Float[NDArray[np.float64], " r"]
Motion = Complex[NDArray[np.complex128], "s h"]

#: Singular values of a state's readings below this share of the largest tell nothing [-].
RANK, FULL_RANK = 1e-2, 1e-8


def find_motion(
    train: Comparison, table: StateTable, model: Model, row: Row, response: Response
) -> tuple[Motion, Complex[NDArray[np.complex128], " s"]]:
    """Harmonics of the place in each state as measured, shape (s, h) [m], and the missing force there [N].

    Where a sensor follows it the fundamental is what that reads. Else it is that of the model, scaled, and moved by
    a force at the place, as the readings say. The missing force explains the fundamentals of the readings best.
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
        # Of a size with the scaled motion, so that what the readings do not tell apart is shared evenly.
        size = abs(own) / max(np.abs(force).max(), 1e-300)
        scaled = np.column_stack([value[at], 1j * value[at]]) * weight[at, None]
        parts = _solve_parts(np.column_stack([scaled, slopes * size]), left, RANK)
        motion[number, 1] += (parts[0] + 1j * parts[1]) * own + size * force @ parts[2:]
    return motion, missing


def _list_scales(model: Model, row: Row) -> dict[str, tuple[int, float]]:
    """Time derivatives, and reading per displacement of the place, of the sensors that follow it."""
    sensors = [item for item in model.sensors if isinstance(item, Sensor) and not item.delay]
    return {
        item.name: (DERIVATIVE[item.quantity], item.gain * float(item.row @ row) / float(row @ row))
        for item in sensors
        if is_parallel(item.row, row)
    }


def _solve_parts(
    table: Complex[NDArray[np.complex128], "n p"], right: Complex[NDArray[np.complex128], " n"], rank: float
) -> Float[NDArray[np.float64], " p"]:
    """Real numbers that solve complex equations best, shape (p,)."""
    return np.asarray(
        np.linalg.lstsq(np.concatenate([table.real, table.imag]), np.concatenate([right.real, right.imag]), rcond=rank)[
            0
        ]
    )
