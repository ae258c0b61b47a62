"""Limits as sensors read them, with the numerical error of the model at the states of the limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.configuration import Configuration
from correlation.model import LineSensor, Model, Sensor
from correlation.noise.nuisance import Budget, make_error_tangents
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import NoSteadyState
from hbsolve.limits.objective import ContactForceHarmonic, Objective, OutputHarmonic
from hbsolve.limits.problem import LimitCurve
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.array_type import Real

#: What a search leaves to be gained, relative to a limit: random histories go no further beyond [-].
SEARCH_ERROR = 5e-4
#: Harmonics and samples of the balance that reads a limit, over those of the search that found it [-].
FINER = 2
#: Frequencies to either side that this change is taken from.
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

    A search with few harmonics finds which sliders lead to a limit, but not how large it is: a static force of a
    contact that slips throughout may be a third off. Each limit is therefore read with twice the harmonics. The
    numerical error is that of contact lines to first order, with the sliders of the limit, and the change by these
    harmonics: the sliders that are extreme with few need not be with many.

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
    seen = Configuration.from_model(model, False, None)
    balance = curve.problem.balance
    finer = replace(model, n_harmonic=FINER * balance.n_harmonic - 1, n_sample=FINER * balance.n_sample)
    finely = Configuration.from_model(finer, False, None)
    errors = make_error_tangents(model, budget)
    # The first two are shifts of the frequency, of the jointed and of the free structure.
    tangents, size = errors.tangents[2:], errors.size[2:]
    result = []
    for states in wanted:
        value, deviation, change = np.full((3, 2, len(curve.angular_frequency)), np.nan)
        names, harmonic = np.array([states.sensor]), np.array([states.harmonic])
        for side, at in np.ndindex(2, len(curve.angular_frequency)):
            state = _state(balance, curve, at, states.motion[side, at], states.slider[side, at])
            if state is None:
                continue
            refined = _state(finely.balance, curve, at, state.motion, states.slider[side, at])
            if refined is None:
                continue
            found, reading = seen.read(state, names, harmonic)[0], finely.read(refined, names, harmonic)[0]
            condensed = curve.point(at).condensed
            rates = seen.slopes(state, condensed, names, harmonic, tangents)[0] if tangents else np.zeros(0)
            if states.harmonic:
                value[side, at] = abs(reading)
                rates = (np.conj(found) * rates).real / max(abs(found), np.finfo(float).tiny)
            else:
                value[side, at], rates = reading.real, rates.real
            known = np.nan_to_num(size * rates)
            # What vibration leaves in a mean is found no better than the vibration, however small the mean is.
            size_of = abs(reading) + (0.0 if states.harmonic else abs(seen.read(state, names, np.array([1]))[0]))
            deviation[side, at] = np.linalg.norm([*known, SEARCH_ERROR * size_of])
            change[side, at] = abs(reading - found)
        deviation = np.hypot(deviation, _pool(change))
        # A negative gain turns a mean around.
        order = np.argsort(value, axis=0)
        result.append(
            LimitReadings(
                value=np.take_along_axis(value, order, axis=0), deviation=np.take_along_axis(deviation, order, axis=0)
            )
        )
    return result


def _pool(change: Float[NDArray[np.float64], "2 f"]) -> Float[NDArray[np.float64], " f"]:
    """Root mean square over neighbouring frequencies and both limits, shape (f,): at one it may be 0 by chance."""
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
