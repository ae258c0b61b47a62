"""Limits as sensors read them, with the numerical error of the model at the states of the limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.configuration import Configuration, Tangent
from correlation.model import LineSensor, Model, Sensor
from correlation.noise.nuisance import Budget, make_contact_errors
from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.errors import NoSteadyState
from hbsolve.limits.objective import ContactForceHarmonic, Objective, OutputHarmonic
from hbsolve.limits.problem import LimitCurve
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.array_type import Real

#: What a search leaves to be gained, relative to a limit: random histories go no further beyond [-].
SEARCH_ERROR = 5e-4
#: Samples of the balances that read a limit, and their harmonics one after the other, over those of the search [-].
SAMPLES, HARMONICS = 16, (1, 2, 4)
#: Frequencies to either side that changes by harmonics are taken from.
NEIGHBOURS = 2


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

    A search finds which sliders lead to a limit, but not how large it is: a static force of a contact that slips
    throughout may be a third off. A contact that closes does so between two samples, so that its slider is off by up to
    a sample's travel until it slips again: an error of first order, whose sign is that of chance, and which may stay as
    it is when samples are doubled. Limits are therefore read with many more samples, of whose error the share 1 / (n -
    1) of the change is left after n times as many, and with harmonics that are doubled until the reading stands still.
    The numerical error has four parts: that of contact lines to first order, with the sliders of the limit; what
    samples leave; the last change by harmonics; and the change of the width of the band, because sliders that are
    extreme with few harmonics need not be with many.

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
    balance = curve.problem.balance
    seen = Configuration.from_model(model, False, None)
    finer = [
        replace(model, n_harmonic=times * (balance.n_harmonic - 1) + 1, n_sample=SAMPLES * balance.n_sample)
        for times in HARMONICS
    ]
    finely = [Configuration.from_model(item, False, None) for item in finer]
    errors = make_contact_errors(model, budget)
    result = []
    for states in wanted:
        value, deviation, sampled, last, moved = np.full((5, 2, len(curve.angular_frequency)), np.nan)
        for side, at in np.ndindex(2, len(curve.angular_frequency)):
            slider = states.slider[side, at]
            state = _state(balance, curve, at, states.motion[side, at], slider)
            if state is None:
                continue
            readings, error = _refined_readings(states, state, curve, at, slider, [seen, *finely])
            if len(readings) < 3:
                continue
            value[side, at] = readings[-1]
            sampled[side, at] = (readings[1] - readings[0]) / (SAMPLES - 1)
            last[side, at], moved[side, at] = readings[-1] - readings[-2], readings[-1] - readings[0]
            rates = (
                _rates(states, state, seen, curve.point(at).condensed, errors.tangents)
                if errors.tangents
                else np.zeros(0)
            )
            deviation[side, at] = np.linalg.norm([*np.nan_to_num(errors.size * rates), error])
        # At one frequency a change may be 0 by chance.
        by_chance = [_pool(item) for item in (sampled, last, np.diff(moved, axis=0))]
        deviation = np.sqrt(deviation**2 + np.square(by_chance).sum(axis=0))
        # A negative gain turns a mean around.
        order = np.argsort(value, axis=0)
        result.append(
            LimitReadings(
                value=np.take_along_axis(value, order, axis=0), deviation=np.take_along_axis(deviation, order, axis=0)
            )
        )
    return result


def _refined_readings(
    states: LimitStates, state: SteadyState, curve: LimitCurve, at: int, slider: Real,
    configurations: Sequence[Configuration],
) -> tuple[list[float], float]:  # fmt: skip
    """Readings as the search has them, with more samples, with more and more harmonics, and the error allowed."""
    readings: list[float] = []
    error = 0.0
    for configuration in configurations:
        refined = state if not readings else _state(configuration.balance, curve, at, state.motion, slider)
        if refined is None:
            break
        state = refined
        z = configuration.read(state, np.array([states.sensor]), np.array([states.harmonic]))[0]
        readings.append(float(abs(z) if states.harmonic else z.real))
        # What vibration leaves in a mean is found no better than the vibration, however small the mean is.
        vibration = 0.0 if states.harmonic else configuration.read(state, np.array([states.sensor]), np.array([1]))[0]
        error = SEARCH_ERROR * float(abs(z) + abs(vibration))
        if len(readings) > 2 and abs(readings[-1] - readings[-2]) <= error:
            break
    return readings, error


def _rates(
    states: LimitStates, state: SteadyState, seen: Configuration, condensed: Condensed, tangents: Sequence[Tangent]
) -> Float[NDArray[np.float64], " t"]:
    """Change of the reading by each tangent of the numerical error, shape (t,)."""
    names, harmonic = np.array([states.sensor]), np.array([states.harmonic])
    rates = seen.slopes(state, condensed, names, harmonic, tangents)[0]
    if not states.harmonic:
        return np.asarray(rates.real)
    found = seen.read(state, names, harmonic)[0]
    return np.asarray((np.conj(found) * rates).real / max(abs(found), np.finfo(float).tiny))


def _pool(change: Float[NDArray[np.float64], "s f"]) -> Float[NDArray[np.float64], " f"]:
    """Root mean square over neighbouring frequencies and limits, shape (f,)."""
    n, result = change.shape[1], np.zeros(change.shape[1])
    for at in range(n):
        near = change[:, max(at - NEIGHBOURS, 0) : at + NEIGHBOURS + 1]
        near = near[np.isfinite(near)]
        result[at] = np.sqrt((near**2).mean()) if len(near) else 0.0
    return result


def _state(balance: HarmonicBalance, curve: LimitCurve, at: int, motion: Real, slider: Real) -> SteadyState | None:
    """The steady state at a limit, in as many harmonics as the balance has; none where there is none."""
    if not np.isfinite(motion).all():
        return None
    start = np.zeros((len(motion), 2 * balance.n_harmonic - 1))
    start[:, : motion.shape[1]] = motion
    try:
        return steady_state(
            balance.at_level(curve.level), float(curve.angular_frequency[at]), start=start, slider=slider
        )
    except NoSteadyState:
        return None
