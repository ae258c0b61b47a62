"""Limits as sensors read them, with the numerical error of the model at the states of the limits."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.configuration import Configuration
from correlation.model import LineSensor, Model, Sensor
from correlation.noise.nuisance import Budget, make_error_tangents
from hbsolve.errors import NoSteadyState
from hbsolve.limits.objective import ContactForceHarmonic, Objective, OutputHarmonic
from hbsolve.limits.problem import LimitCurve
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from hbsolve.truncation import truncation
from reduction.array_type import Real

#: What a search leaves to be gained, relative to a limit: random histories go no further beyond [-].
SEARCH_ERROR = 5e-4
#: Frequencies of each level at which the error of truncation is estimated [-].
LOOKED_AT = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitStates:
    """States at the limits of one sensor and harmonic at one level; arrays have the lower limit first.

    Parameters
    ----------
    sensor
        Name of the sensor.
    harmonic
        0 or 1 [-].
    motion
        Coefficients of the joint directions, shape (2, f, d, nh) [m]; NaN where no limit was found.
    slider
        Slider positions, shape (2, f, s) [m].
    """

    sensor: str
    harmonic: int
    motion: Float[Real, "2 f d nh"]
    slider: Float[Real, "2 f s"]


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitReadings:
    """What a sensor reads at its limits, and the standard deviation by numerical error, shape (2, f) [its unit]."""

    value: Float[NDArray[np.float64], "2 f"]
    deviation: Float[NDArray[np.float64], "2 f"]


def objective_of(model: Model, sensor: Sensor | LineSensor, harmonic: int) -> Objective:
    """What the limits of a sensor's harmonic bound: an amplitude of the displacement that it follows, or a force."""
    if isinstance(sensor, Sensor):
        return OutputHarmonic(row=sensor.row, harmonic=harmonic)
    direction = -1 if sensor.component == "normal" else 0
    return ContactForceHarmonic(joints=model.lines[sensor.line], direction=direction, harmonic=harmonic)


def read_limits(curve: LimitCurve, model: Model, budget: Budget, wanted: Sequence[LimitStates]) -> list[LimitReadings]:
    """Readings at the limits of one level.

    The numerical error is that of contact lines to first order, with the sliders of the limit, and what harmonics and
    samples leave out.

    Parameters
    ----------
    curve
        Balance, level and frequencies of the limits.
    model
        Model of the same system, which has the sensors.
    budget
        Numerical error; the part by frequency is left to the band, which moves along the limits.
    wanted
        States of each sensor.
    """
    truncated = _truncation(curve, wanted[0])
    seen = Configuration.from_model(model, False, None)
    errors = make_error_tangents(model, budget)
    # The first two are shifts of the frequency, of the jointed and of the free structure.
    tangents, size = errors.tangents[2:], errors.size[2:]
    result = []
    for states in wanted:
        value, deviation = np.full((2, 2, len(curve.angular_frequency)), np.nan)
        names, harmonic = np.array([states.sensor]), np.array([states.harmonic])
        for side, at in np.ndindex(2, len(curve.angular_frequency)):
            state = _state(curve, states, side, at)
            if state is None:
                continue
            reading = seen.read(state, names, harmonic)[0]
            condensed = curve.point(at).condensed
            rates = seen.slopes(state, condensed, names, harmonic, tangents)[0] if tangents else np.zeros(0)
            if states.harmonic:
                value[side, at] = abs(reading)
                rates = (np.conj(reading) * rates).real / max(abs(reading), np.finfo(float).tiny)
            else:
                value[side, at], rates = reading.real, rates.real
            known = np.nan_to_num(size * rates)
            relative = np.hypot(SEARCH_ERROR, truncated[at])
            # What vibration leaves in a mean is as inexact as the vibration, however small the mean is.
            size_of = abs(reading) + (0.0 if states.harmonic else abs(seen.read(state, names, np.array([1]))[0]))
            deviation[side, at] = np.hypot(np.linalg.norm(known), relative * size_of)
        # A negative gain turns a mean around.
        order = np.argsort(value, axis=0)
        result.append(
            LimitReadings(
                value=np.take_along_axis(value, order, axis=0), deviation=np.take_along_axis(deviation, order, axis=0)
            )
        )
    return result


def _state(curve: LimitCurve, states: LimitStates, side: int, at: int) -> SteadyState | None:
    """The steady state at a limit; none where there is none."""
    if not np.isfinite(states.motion[side, at]).all():
        return None
    try:
        return steady_state(
            curve.problem.balance.at_level(curve.level), float(curve.angular_frequency[at]),
            start=states.motion[side, at], slider=states.slider[side, at],
        )  # fmt: skip
    except NoSteadyState:
        return None


def _truncation(curve: LimitCurve, states: LimitStates) -> Float[NDArray[np.float64], " f"]:
    """Relative error by the harmonics and samples left out, from some of the frequencies, shape (f,) [-]."""
    n = len(curve.angular_frequency)
    places, errors = [], []
    for at in np.unique(np.linspace(0, n - 1, min(n, LOOKED_AT)).round().astype(int)):
        both = [state for side in (0, 1) if (state := _state(curve, states, side, int(at))) is not None]
        found = [truncation(curve.problem.balance, state) for state in both]
        if found:
            places.append(at)
            errors.append(max(item.harmonics + item.samples for item in found))
    return np.interp(np.arange(n), places, errors) if places else np.zeros(n)
