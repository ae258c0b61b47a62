"""States of a model under additional forces at a place, one set of harmonics per state, and their derivatives.

The forces are prescribed and do not depend on the motion, so that there is a single steady state where a law would have
two.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.model import Model, Sensor
from correlation.model_solver import Tangent
from correlation.prediction import Key, Points, Prediction, Predictor
from correlation.row_table import join_tables
from hbsolve.balance import HarmonicBalance
from hbsolve.model_rates import ModelParameter
from hbsolve.state import SteadyState

Row = Float[NDArray[np.float64], " r"]

#: Prefix of the name of a virtual sensor at a place.
FOLLOWS = "motion of "


@dataclass(frozen=True, kw_only=True, eq=False)
class StateTable:
    """Measured states.

    Parameters
    ----------
    keys
        Configuration, level [N] and frequency [Hz] of each state.
    force
        Amplitude of the force in each state, shape (s,) [N].
    number
        Index of the state of each measured point, shape (k,); -1 without a state.
    """

    keys: tuple[Key, ...]
    force: Float[NDArray[np.float64], " s"]
    number: Int[NDArray[np.int64], " k"]

    @classmethod
    def from_points(cls, points: Points, states: Mapping[Key, SteadyState]) -> "StateTable":
        """States of measured points for which a model has a solution."""
        keys = list(zip(points.free.tolist(), points.level.tolist(), points.frequency.tolist(), strict=True))
        force = {key: float(value) for key, value in zip(keys, points.force, strict=True) if key in states}
        number = {key: place for place, key in enumerate(force)}
        return cls(
            keys=tuple(force), force=np.array([*force.values()]), number=np.array([number.get(key, -1) for key in keys])
        )

    @property
    def angular_frequency(self) -> Float[NDArray[np.float64], " s"]:
        """Angular frequency of each state, shape (s,) [rad/s]."""
        return 2 * np.pi * np.array([frequency for _, _, frequency in self.keys])


@dataclass(frozen=True, kw_only=True, eq=False)
class Response:
    """Readings, motions of places and their derivatives in each state; p places, t further tangents, h harmonics.

    Parameters
    ----------
    value
        Readings, shape (k,).
    motion
        Harmonics of the motion of each place, shape (s, p, h) [m].
    slopes
        Derivatives of readings with respect to real and imaginary part of a force at each place, shape (k, p, h, 2).
    receptance
        Derivatives of the fundamental motion of each place with respect to real and imaginary part of the fundamental
        force at the place, shape (s, p, 2) [m/N].
    tangents
        Derivatives of readings with respect to further parameters, shape (k, t).
    states
        States, by configuration, level and frequency.
    """

    value: Complex[NDArray[np.complex128], " k"]
    motion: Complex[NDArray[np.complex128], "s p h"]
    slopes: Complex[NDArray[np.complex128], "k p h 2"]
    receptance: Complex[NDArray[np.complex128], "s p 2"]
    tangents: Complex[NDArray[np.complex128], "k t"]
    states: Mapping[Key, SteadyState]


def compute_response(
    predictor: Predictor, model: Model, prediction: Prediction, table: StateTable, rows: Sequence[Row], count: int,
    tangents: Sequence[Tangent],
) -> Response:  # fmt: skip
    """Linearise the response of a model about its prediction with respect to forces at places.

    Parameters
    ----------
    predictor, model, prediction
        Predictor, model and prediction of the measured points.
    table
        States of the prediction.
    rows
        Places, rows over the degrees of freedom, shape (r,) each [-].
    count
        Number of harmonics of the forces, the mean first [-].
    tangents
        Further parameters.
    """
    points, seeing, (p, s) = predictor.points, _follow_places(model, rows), (len(rows), len(table.keys))
    if not s:
        return _make_empty_response(len(points), p, count, len(tangents))
    free, level, frequency = (np.repeat(np.array(column), p) for column in zip(*table.keys, strict=True))
    more = Points(
        free=free.astype(bool), level=level, frequency=frequency, sensor=np.tile(_make_names(p), s),
        harmonic=np.ones(s * p, dtype=np.int64), force=np.repeat(table.force, p),
    )  # fmt: skip
    both = join_tables([points, more])
    listed = [*(tangent for row in rows for tangent in _list_forces(model, row, count)), *tangents]
    result = np.nan_to_num(replace(predictor, points=both).derivatives(seeing, prediction, listed))
    n = 2 * p * count
    # Loads are defined for a level of 1 N.
    forces = (result[:, :n] / both.force[:, None]).reshape(-1, p, count, 2)
    places = np.arange(p)
    return Response(
        value=prediction.value,
        motion=np.array([np.array(rows) @ prediction.states[key].coefficients[:count].T for key in table.keys]),
        slopes=forces[: len(points)],
        receptance=forces[len(points) :, :, 1].reshape(s, p, p, 2)[:, places, places],
        tangents=result[: len(points), n:],
        states={key: prediction.states[key] for key in table.keys},
    )  # fmt: skip


def compute_loaded_response(
    predictor: Predictor, model: Model, near: Mapping[Key, SteadyState], table: StateTable, row: Row,
    loads: Complex[NDArray[np.complex128], "s h"], tangents: Sequence[Tangent],
) -> Response:  # fmt: skip
    """Linearise the response under forces of given harmonics at one place in each state, shape (s, h) [N].

    Parameters
    ----------
    predictor, model
        Predictor of the measured points, and the model.
    near
        Initial guesses of the states; they also give the initial slider positions.
    table, row, loads
        States, place and forces.
    tangents
        Further parameters.
    """
    points, count = predictor.points, loads.shape[1]
    whole = _make_empty_response(len(points), 1, count, len(tangents))
    motion, own = (
        np.full((len(table.keys), 1, count), np.nan, dtype=complex),
        np.zeros((len(table.keys), 1, 2), dtype=complex),
    )
    states: dict[Key, SteadyState] = {}
    for number, key in enumerate(table.keys):
        at = np.flatnonzero(table.number == number)
        alone = points.where(at)
        loaded = _load(model, row, loads[number] / table.force[number], loads[number, 0].real)
        start = near[key]
        single = Predictor(points=alone, slider=partial(_take_sliders, start))
        known = Prediction(points=alone, value=np.zeros(len(at), dtype=complex), states={key: start})
        result = single.predict(loaded, known)
        if key not in result.states:
            continue
        mine = StateTable(keys=(key,), force=table.force[number : number + 1], number=np.zeros(len(at), dtype=np.int64))
        part = compute_response(single, loaded, result, mine, [row], count, tangents)
        whole.value[at], whole.slopes[at], whole.tangents[at] = part.value, part.slopes, part.tangents
        motion[number], own[number], states[key] = part.motion[0], part.receptance[0], result.states[key]
    return replace(whole, motion=motion, receptance=own, states=states)


def _take_sliders(state: SteadyState, balance: HarmonicBalance) -> NDArray[np.float64]:
    """Initial slider positions of a state, for any balance."""
    del balance
    return state.initial_slider


def _make_names(count: int) -> NDArray[np.str_]:
    return np.array([f"{FOLLOWS}{number}" for number in range(count)])


def _follow_places(model: Model, rows: Sequence[Row]) -> Model:
    follow = (
        Sensor(name=str(name), row=row, relative=True) for name, row in zip(_make_names(len(rows)), rows, strict=True)
    )
    return replace(model, sensors=(*model.sensors, *follow))


def _load(model: Model, row: Row, per_level: Complex[NDArray[np.complex128], " h"], mean: float) -> Model:
    """The model with forces along a row: harmonics for a level of 1 N, and a mean [N]."""
    own = model.system.dynamic
    dynamic = np.zeros((max(len(own), len(per_level)), len(row)), dtype=np.complex128)
    dynamic[: len(own)] += own
    dynamic[1 : len(per_level)] += per_level[1:, None] * row
    return model.with_system(harmonic_force=dynamic, static_load=model.system.static + mean * row)


def _list_forces(model: Model, row: Row, count: int) -> list[Tangent]:
    """Tangents of the real and imaginary part of a force in each harmonic; zero for the imaginary part of the mean."""
    tangents = []
    for harmonic in range(count):
        for part in (1.0, 1j if harmonic else 0.0):
            force = np.zeros((model.n_harmonic, len(row)), dtype=np.complex128)
            force[harmonic] = part * row
            rate = ModelParameter(harmonic_force=force)
            tangents.append(Tangent(jointed=rate, free=rate, gain={}))
    return tangents


def _make_empty_response(k: int, p: int, count: int, t: int) -> Response:
    nothing = np.zeros((0, p, count), dtype=complex)
    return Response(
        value=np.full(k, np.nan, dtype=complex), motion=nothing, slopes=np.zeros((k, p, count, 2), dtype=complex),
        receptance=np.zeros((0, p, 2), dtype=complex), tangents=np.zeros((k, t), dtype=complex), states={},
    )  # fmt: skip
