"""Sensor readings at limit states, with the numerical error of the model at these states."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.family.band import LimitChange
from correlation.family.frequency_offset import split_frequency_part
from correlation.family.limit_change import SolveEffort, Variant, VariantScale, find_state, make_variants
from correlation.model import COMPONENTS, AnySensor, LineSensor, Model, Sensor
from correlation.model_solver import ModelSolver, Tangent
from correlation.noise.nuisance import Budget, make_contact_errors, make_frequency_shifts
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.objective import ContactForceHarmonic, Objective, OutputHarmonic
from hbsolve.limits.problem import LimitCurve
from hbsolve.refinement import MARGIN
from hbsolve.state import SteadyState
from reduction.array_type import Real

#: Relative error of a search for limits: random histories do not exceed a limit by more [-].
SEARCH_ERROR = 5e-4
#: Samples, and sequence of harmonics, of the balances that compute a reading, over those of the search [-].
SAMPLES, HARMONICS = 16, (1, 2, 4, 8, 16)
#: Largest number of unknowns of further balances, since Newton's method then takes seconds, and number of the first
#: balances, which are always used.
MOST_UNKNOWN, FEWEST_BALANCE = 700, 3
#: Number of neighbouring frequencies on either side over which changes by harmonics are averaged.
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
    """Readings of a sensor at its limits.

    Parameters
    ----------
    value, deviation
        Readings, and their standard deviations by numerical error, shape (2, f) [unit of the sensor].
    shift
        Relative standard deviation of the frequency by numerical error of the contacts, not included in `deviation`
        [-].
    by_force, by_preload
        Readings at other forces, amplitudes over the factor of the force, and at other preloads, by the groups of the
        model; None and empty if not requested.
    """

    value: Float[NDArray[np.float64], "2 f"]
    deviation: Float[NDArray[np.float64], "2 f"]
    shift: float
    by_force: LimitChange | None = None
    by_preload: tuple[LimitChange, ...] = ()


def make_reading_objective(model: Model, sensor: AnySensor, harmonic: int) -> Objective:
    """Quantity bounded by the limits of a sensor's harmonic: an amplitude of displacement, or a force."""
    if not isinstance(sensor, LineSensor):
        return OutputHarmonic(row=sensor.row, harmonic=harmonic)
    direction = -1 if sensor.component == "normal" else 0
    return ContactForceHarmonic(joints=model.lines[sensor.line], direction=direction, harmonic=harmonic)


def read_limits(
    curve: LimitCurve, model: Model, budget: Budget, wanted: Sequence[LimitStates],
    force_span: float = 0.0, preload_span: float = 0.0,
) -> list[LimitReadings]:  # fmt: skip
    """Readings at the limits of one level.

    A search finds the sliders of a limit, but not its accurate value: the static force of a contact in full slip may
    have an error of a third. A contact closes between two samples, so that its slider has an error of up to the travel
    in one sample until it slips again. This error is of first order, has a random sign, and may not change when the
    number of samples is doubled. Limits are therefore computed with n times as many samples, which leaves an error of
    1 / (n - 1) of the change, and with harmonics that are doubled until the state has converged. By chance, a reading
    with an error of a tenth, such as the static force of a contact in full slip, may not change in one doubling; but
    then other motions and contact forces do.

    The numerical error has four parts. First, that of contact lines to first order, with the sliders of the limit,
    without its shift of the limits along the frequency. Second, the remaining error by samples. Third, the last change
    by harmonics, times `MARGIN` if the state has not converged, since a stiff contact rings at omitted harmonics.
    Fourth, the change of the width of the band, since sliders that are extreme with few harmonics need not be so with
    many.

    Parameters
    ----------
    curve
        Balance, level and frequencies of the limits.
    model
        Model of the same system, with the sensors.
    budget
        Numerical error; its frequency part is handled by the band, which shifts the limits.
    wanted
        States of each sensor.
    force_span, preload_span
        Natural logarithm of the largest factor on the force, and on each group of preloads, for which readings are
        computed; 0 for none [-].
    """
    balance, sensors = curve.problem.balance, {item.name: item for item in model.sensors}
    solver = ModelSolver.from_model(model, False, None)
    finely = _make_finer_solvers(model, balance)
    scales = make_variants(curve, model, force_span, preload_span)
    errors, (frequency, _) = make_contact_errors(model, budget), make_frequency_shifts(model, by_exciter=True)
    result = []
    for states in wanted:
        objective = make_reading_objective(model, sensors[states.sensor], states.harmonic)
        value, searched, sampled, last, moved = np.full((5, 2, len(curve.angular_frequency)), np.nan)
        by_contact, slope = np.zeros((len(errors.tangents), *value.shape)), np.full(value.shape, np.nan)
        changed = [np.full((len(scale.variants), *value.shape), np.nan) for scale in scales]
        for side, at in np.ndindex(2, len(curve.angular_frequency)):
            slider = states.slider[side, at]
            state = _find_limit_state(balance, curve, at, states.motion[side, at], slider, SolveEffort.FEW_STARTS)
            if state is None:
                continue
            refined = _refine_readings(states, state, curve, at, slider, [(solver, solver), *finely])
            readings = refined.values
            if len(readings) < 3:
                continue
            value[side, at] = readings[-1]
            sampled[side, at] = (readings[1] - readings[0]) / (SAMPLES - 1)
            last[side, at] = (1.0 if refined.still else MARGIN) * (readings[-1] - readings[-2])
            moved[side, at] = readings[-1] - readings[0]
            searched[side, at] = refined.error
            for scale, others in zip(scales, changed, strict=True):
                others[:, side, at] = [
                    _read_variant(states, objective, list(LimitSide)[side], balance, state, refined, variant)
                    for variant in scale.variants
                ]
            if errors.tangents:
                *rates, slope[side, at] = _compute_rates(states, state, solver, [*errors.tangents, frequency])
                by_contact[:, side, at] = np.nan_to_num(errors.size * np.array(rates))
        # At a single frequency a change may be zero by chance.
        by_chance = [_average_over_neighbours(item) for item in (sampled, last, np.diff(moved, axis=0))]
        shifts, rest = split_frequency_part(by_contact, value, slope)
        deviation = np.sqrt(np.square(rest).sum(axis=0) + searched**2 + np.square(by_chance).sum(axis=0))
        shift = float(np.linalg.norm(shifts))
        result.append(_sort_limits(value, deviation, shift, scales, changed, by_force=bool(force_span)))
    return result


def _sort_limits(
    value: Float[NDArray[np.float64], "2 f"],
    deviation: Float[NDArray[np.float64], "2 f"],
    shift: float,
    scales: Sequence[VariantScale],
    changed: Sequence[Float[NDArray[np.float64], "k 2 f"]],
    *,
    by_force: bool,
) -> LimitReadings:
    """Readings with the lower limit first: a negative gain reverses the order of means."""
    order = np.argsort(value, axis=0)
    by = [
        LimitChange(scale.log_ratio, np.take_along_axis(one, order[None], axis=1))
        for scale, one in zip(scales, changed, strict=True)
    ]
    return LimitReadings(
        value=np.take_along_axis(value, order, axis=0),
        deviation=np.take_along_axis(deviation, order, axis=0),
        shift=shift,
        by_force=by[0] if by_force else None,
        by_preload=tuple(by[1:] if by_force else by),
    )


def _make_finer_solvers(model: Model, balance: HarmonicBalance) -> list[tuple[ModelSolver, ModelSolver]]:
    """Solvers with more samples, then more harmonics; the second of each pair has the check sensors."""
    checked, finely = _with_check_sensors(model), []
    for number, times in enumerate(HARMONICS):
        n_harmonic, n_sample = times * (balance.n_harmonic - 1) + 1, SAMPLES * balance.n_sample
        if number >= FEWEST_BALANCE and balance.n_direction * (2 * n_harmonic - 1) > MOST_UNKNOWN:
            break
        solver, check = (
            ModelSolver.from_model(replace(item, n_harmonic=n_harmonic, n_sample=n_sample), False, None)
            for item in (model, checked)
        )
        finely.append((solver, check))
    return finely


class _Refined(NamedTuple):
    """A limit computed with successively finer balances."""

    values: list[float]
    """Readings with the balance of the search, with more samples, then with more harmonics."""
    error: float
    """Allowed error."""
    still: bool
    """Whether the last change is below `error`."""
    state: SteadyState
    solver: ModelSolver
    """Solver of the last balance."""


def _refine_readings(
    states: LimitStates, state: SteadyState, curve: LimitCurve, at: int, slider: Real,
    solvers: Sequence[tuple[ModelSolver, ModelSolver]],
) -> _Refined:  # fmt: skip
    """Readings of a sensor with successively finer balances, until its state has converged."""
    readings: list[float] = []
    error, before, reached = 0.0, None, solvers[0][0]
    for number, (solver, check) in enumerate(solvers):
        refined_state: SteadyState | None = state
        if number:
            refined_state = _find_limit_state(solver.balance, curve, at, state.motion, slider, _choose_effort(number))
        if refined_state is None:
            break
        state, reached = refined_state, solver
        readings.append(_read_value(states, state, solver))
        # A mean that is caused by vibration is no more accurate than the vibration, even if the mean is small.
        vibration = 0.0 if states.harmonic else solver.read(state, np.array([states.sensor]), np.array([1]))[0]
        error = SEARCH_ERROR * float(abs(readings[-1]) + abs(vibration))
        if len(readings) > 1:
            now = _read_checks(check, state)
            if before is not None and abs(readings[-1] - readings[-2]) <= error and _is_converged(before, now):
                return _Refined(readings, error, True, state, reached)
            before = now
    return _Refined(readings, error, False, state, reached)


def _read_variant(
    states: LimitStates, objective: Objective, side: LimitSide, balance: HarmonicBalance, state: SteadyState,
    refined: _Refined, variant: Variant,
) -> float:  # fmt: skip
    """A reading at the limit of a variant, over the factor of the force, with the last balance of the limit itself.

    NaN if no state is found; means are not scaled.
    """
    own = variant.limit(balance, objective, side, state)
    if own is None:
        return np.nan
    effort = _choose_effort(len(refined.values) - 1)
    solver, result = variant.refine(refined.solver.balance, own, state, refined.state, effort)
    if result is None:
        return np.nan
    return _read_value(states, result, solver) / (variant.factor if states.harmonic else 1.0)


def _read_value(states: LimitStates, state: SteadyState, solver: ModelSolver) -> float:
    """Amplitude, or signed mean."""
    z = solver.read(state, np.array([states.sensor]), np.array([states.harmonic]))[0]
    return float(abs(z) if states.harmonic else z.real)


def _with_check_sensors(model: Model) -> Model:
    """The model with its motion sensors, and sensors of both forces of all lines, renamed."""
    motions = [item for item in model.sensors if isinstance(item, Sensor)]
    forces = [(line, component) for line in model.lines for component in COMPONENTS]
    return replace(
        model,
        sensors=(
            *(replace(item, name=f"motion {number}") for number, item in enumerate(motions)),
            *(LineSensor(name=" ".join(item), line=item[0], component=item[1]) for item in forces),
        ),
    )


def _read_checks(check: ModelSolver, state: SteadyState) -> Complex[NDArray[np.complex128], "2 k"]:
    """Mean and fundamental of the check sensors; means of motions are set to zero."""
    sensors = check.model.sensors
    names = np.array([item.name for item in sensors])
    mean = check.read(state, names, np.zeros(len(names), dtype=np.int64))
    forces = np.array([isinstance(item, LineSensor) for item in sensors])
    return np.array([np.where(forces, mean, 0.0), check.read(state, names, np.ones(len(names), dtype=np.int64))])


def _is_converged(before: Complex[NDArray[np.complex128], "2 k"], now: Complex[NDArray[np.complex128], "2 k"]) -> bool:
    """Whether no check sensor has changed by more than the error of a search."""
    size = np.abs(now)
    size[0] += size[1]
    return bool((np.abs(np.abs(now) - np.abs(before)) <= SEARCH_ERROR * size).all())


def _compute_rates(
    states: LimitStates, state: SteadyState, solver: ModelSolver, tangents: Sequence[Tangent]
) -> Float[NDArray[np.float64], " t"]:
    """Change of the reading by each tangent of the numerical error, shape (t,)."""
    names, harmonic = np.array([states.sensor]), np.array([states.harmonic])
    frequency = state.angular_frequency / (2 * np.pi * (1 + solver.linear.frequency_shift))
    rates = solver.slopes(state, frequency, names, harmonic, solver.rates(tangents))[0]
    if not states.harmonic:
        return np.asarray(rates.real)
    reading = solver.read(state, names, harmonic)[0]
    return np.asarray((np.conj(reading) * rates).real / max(abs(reading), np.finfo(float).tiny))


def _average_over_neighbours(change: Float[NDArray[np.float64], "s f"]) -> Float[NDArray[np.float64], " f"]:
    """Root mean square over neighbouring frequencies and limits, shape (f,)."""
    n, result = change.shape[1], np.zeros(change.shape[1])
    for at in range(n):
        near = change[:, max(at - NEIGHBOURS, 0) : at + NEIGHBOURS + 1]
        near = near[np.isfinite(near)]
        result[at] = np.sqrt((near**2).mean()) if len(near) else 0.0
    return result


def _choose_effort(number: int) -> SolveEffort:
    """Search effort of the n-th refinement."""
    return SolveEffort.NEWTON_ONLY if number > FEWEST_BALANCE else SolveEffort.FEW_STARTS


def _find_limit_state(
    balance: HarmonicBalance, curve: LimitCurve, at: int, motion: Real, slider: Real, effort: SolveEffort
) -> SteadyState | None:
    """The steady state at a limit with a given balance; see `find_state`."""
    if not np.isfinite(motion).all():
        return None
    at_level = balance.at_level(curve.level)
    condensed = at_level.at(float(curve.angular_frequency[at]))
    return find_state(at_level, condensed, motion, slider, effort)
