"""Frequency responses of a test with broadband excitation: measured by the analyser, or estimated from a record.

The structure is taken as linear at the level of the test. If the level is stated, the responses are also used as
steady states of that level, thinned to the lines at which they change; otherwise only their modes are used.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from correlation.campaign.measurable import MAX_READING, MIN_READING, REMEDY
from correlation.campaign.measured_files import take_rows, with_rows, without_padding
from correlation.campaign.measurement import CONFIGURATIONS, MeasuredSensor, Measurement
from correlation.campaign.measurement_unit import read_si_quantity
from correlation.campaign.signal_entry import SignalEntry, read_signal
from correlation.campaign.toml_table import TomlTable
from correlation.data_type.linear_response import predict_linear_response
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.mode import predict_mode
from correlation.data_type.mode_set import correct_modes
from correlation.data_type.registry import DATA_TYPES, DataContext, DataType, Features, Panel
from correlation.data_type.response_modes import read_modes
from correlation.file.column import MeasuredFile
from correlation.modal.fit_modes import FEWEST_LINES
from correlation.modal.window import Window
from correlation.model import DERIVATIVE, Model
from correlation.noise.smoothness import estimate_curve_noise
from correlation.signal.frequency_response import (
    Excitation,
    FrequencyResponse,
    compute_coherence_limit,
    estimate_frequency_response,
)
from correlation.signal.record import note_rounded_time

Frequencies = Float[NDArray[np.float64], " f"]

ESTIMATORS = ("H1", "H2")
#: Columns of an entry that are not sensors.
NON_SENSOR_COLUMNS = ("frequency", "time", "force")
#: Largest number of steady states of a response, and smallest coherence of a steady state [-].
MOST_STATES, COHERENT = 60, 0.8
#: Largest excess of a coherence over 1: analysers compute it with few digits [-].
ROUNDED = 1e-3


def read_frequency_response(table: TomlTable, context: DataContext) -> MeasuredResponse:
    """Read an ``[[frf]]`` of a manifest.

    Raises
    ------
    CampaignError
        A key or value cannot be used, or the columns are not those of a frequency response.
    """
    columns = table.table("columns")
    sensors = [sensor for sensor in context.sensors if sensor.name in columns.values]
    own = {name: read_signal(columns, name) for name in NON_SENSOR_COLUMNS if name in columns.values}
    signals = {sensor.name: read_signal(columns, sensor.name) for sensor in sensors}
    columns.known.update((*NON_SENSOR_COLUMNS, *(sensor.name for sensor in context.sensors)))
    columns.finish()
    coherences = table.table("coherence", required=False)
    coherent = {name: read_signal(coherences, name) for name in signals if name in coherences.values}
    coherences.finish()
    if not sensors:
        raise table.problem("columns", "names no sensor: add one", show=False)
    for sensor in sensors:
        if sensor.quantity not in DERIVATIVE:
            raise columns.problem(sensor.name, f"is a {sensor.quantity}: a frequency response has motions; remove it")
    if ("frequency" in own) == ("time" in own):
        raise columns.problem(
            "frequency", "name the column of the frequency (responses of an analyser) or of the time (a record to "
            "estimate them from), one of them", show=False,
        )  # fmt: skip
    names = _list_columns(*own.values(), *signals.values(), *coherent.values())
    # A spectral line may lack a value of one sensor; a time sample needs the values of all channels.
    needed = None if "time" in own else _list_columns(*own.values())
    file = take_rows(table, context.files.read(table.take("file", str)), names, needed=needed)
    file = without_padding(file, own["time"].columns.values()) if "time" in own else file
    level = _read_level(table)
    tests = [test.name for test in context.tests]
    test = tests.index(table.choice("test", tests)) if "test" in table.values else -1
    configuration = context.tests[test].configuration if test >= 0 else table.choice("configuration", CONFIGURATIONS)
    suspicions: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    if "frequency" in own:
        frequency, value, coherence = _read_lines(table, own, signals, coherent, file, sensors, context)
        suspicions, averages = _suspect_degrees(signals, file), None
        window, decay = _read_window(table)
    else:
        estimator = table.choice("estimator", ESTIMATORS) if "estimator" in table.values else "H1"
        with table.reading(file.path.name):
            result, kind = _estimate(table, own, signals, file, sensors, context)
        frequency, coherence, averages, suspicions = (
            result.frequency, result.coherence, result.averages, result.suspicions
        )  # fmt: skip
        value = result.h1 if estimator == "H1" else result.h2
        window, decay = Window.UNKNOWN, 0.0
        if kind is not Excitation.RANDOM:
            window = Window.NONE
        elif estimator == "H1":  # H2 is the quotient of two smeared spectra
            window = Window.HANN
        remarks = note_rounded_time(own["time"].or_unit(file, "s").real_values(file, "s"))
    there = frequency > 0
    response = MeasuredResponse(
        name=table.take("name", str),
        test=test,
        configuration=configuration,
        sensors=tuple(sensor.name for sensor in sensors),
        frequency=frequency[there],
        value=value[:, there],
        units=tuple(f"{sensor.unit} per {context.units.level_si or context.units.level_unit}" for sensor in sensors),
        coherence=coherence[:, there],
        level=None if level is None else level * context.units.level_factor,
        repeat=table.take("repeat", int, 1),
        coherence_limit=compute_coherence_limit(averages, value.size),
        held_out=table.take("held_out", bool, False),
        window=window,
        decay=decay,
        suspicions=suspicions + _find_dead(value[:, there], sensors),
        remarks=remarks + _describe_gaps(value[:, there], sensors),
    )
    if response.level is not None and test < 0:
        raise table.problem("level", "turns the response into steady states: name their test as well")
    table.finish()
    return read_modes(response, sensors, context.analyse)


def _read_window(table: TomlTable) -> tuple[Window, float]:
    """Window of an analyser, and the rate of an exponential window, 0 without one [1/s]."""
    window, decay = Window.UNKNOWN, 0.0
    if "window" in table.values:
        window = Window(table.choice("window", [item.value for item in Window]))
    if "exponential_window" in table.values:
        decay = 1 / table.converted("exponential_window", _time_constant)
        if "level" in table.values:
            raise table.problem(
                "level",
                "turns the response into steady states, but it is estimated from decays: leave out level",
                show=False,
            )
    return window, decay


def _time_constant(value: object) -> float:
    constant = read_si_quantity(value, "s")
    if not constant > 0:
        raise ValueError("is the time in which the window falls to 1/e: give one above zero")
    return constant


def _read_level(table: TomlTable) -> float | None:
    """Read the level, in the unit of the campaign's levels; None if it is not given."""
    level = table.values.get("level")
    table.known.add("level")
    if level is None:
        return None
    if isinstance(level, bool) or not isinstance(level, int | float) or not level > 0:
        raise table.problem("level", "must be a number above zero in the unit of the campaign's levels")
    if not MIN_READING <= level <= MAX_READING:
        raise table.problem("level", REMEDY)
    return float(level)


def _list_columns(*entries: SignalEntry) -> list[str]:
    """Names of all columns of signals."""
    return [name for entry in entries for name in entry.columns.values()]


def _read_lines(
    table: TomlTable,
    own: Mapping[str, SignalEntry],
    signals: Mapping[str, SignalEntry],
    coherent: Mapping[str, SignalEntry],
    file: MeasuredFile,
    sensors: Sequence[MeasuredSensor],
    context: DataContext,
) -> tuple[Frequencies, NDArray[np.complex128], NDArray[np.float64]]:
    """Read frequencies, responses and coherences of an analyser.

    Responses are NaN where ``missing = "skip"`` leaves out a value of a sensor.
    """
    frequency = own["frequency"].or_unit(file, "Hz").real_values(file, "Hz")
    value = np.full((len(sensors), len(frequency)), np.nan, dtype=np.complex128)
    coherence = np.ones(value.shape)
    for row, sensor in enumerate(sensors):
        names = _list_columns(*(given[sensor.name] for given in (signals, coherent) if sensor.name in given))
        columns = {name: file.column(name) for name in (*names, *_list_columns(*own.values()))}
        if any(len(column.values) != len(frequency) for column in columns.values()):
            raise signals[sensor.name].problem("its columns are not as long as that of the frequency")
        there = np.all([np.isfinite(columns[name].values) for name in names], axis=0)
        if not there.any() or table.values.get("missing") != "skip":
            there[:] = True  # missing values are refused below
        present = with_rows(file, columns, there)
        value[row, there] = _divide_by_force(signals[sensor.name], own.get("force"), present, sensor, context)
        if sensor.name in coherent:
            coherence[row, there] = _read_coherence(coherent[sensor.name], present)
    return frequency, value if context.units.time_sign > 0 else value.conj(), coherence


def _describe_gaps(value: Complex[NDArray[np.complex128], "c f"], sensors: Sequence[MeasuredSensor]) -> tuple[str, ...]:
    """Remark on sensors without values at some lines, and on the number of lines for the fit of modes."""
    there = np.isfinite(value)
    if there.all():
        return ()
    lacking = zip(sensors, (~there).sum(axis=1).tolist(), strict=True)
    sentence = ", ".join(f'"{item.name}" has no number at {n} of {value.shape[1]} lines' for item, n in lacking if n)
    if len(sensors) > 1:
        sentence += (
            f"; the modes are fitted to the {there.all(axis=0).sum()} lines where all sensors have one: give a sensor "
            "that lacks many its own [[frf]]"
        )
    return (sentence,)


def _suspect_degrees(signals: Mapping[str, SignalEntry], file: MeasuredFile) -> tuple[str, ...]:
    """Suspicion about sensors whose phases look like degrees, in one sentence."""
    result = {name: why for name, signal in signals.items() if (why := signal.suspect_degrees(file))}
    if len(result) < 2:
        return tuple(result.values())
    return (f"the phases of {', '.join(result)}: {next(iter(result.values()))}",)


def _find_dead(value: Complex[NDArray[np.complex128], "c f"], sensors: Sequence[MeasuredSensor]) -> tuple[str, ...]:
    """Suspicions about sensors with the same value at all lines."""
    dead = [
        item.name
        for item, row in zip(sensors, value, strict=True)
        if len(known := row[np.isfinite(row)]) >= FEWEST_LINES and (known == known[0]).all()
    ]
    return tuple(f'"{name}" has one value at all lines: a dead channel? Remove it from the columns' for name in dead)


def _divide_by_force(
    signal: SignalEntry, force: SignalEntry | None, file: MeasuredFile, sensor: MeasuredSensor, context: DataContext
) -> Complex[NDArray[np.complex128], " f"]:
    """Response per unit of force, in SI as far as it is calibrated: as in the file, or divided by the given force."""
    unit, level_si = sensor.unit if sensor.calibrated else "", context.units.level_si
    if force is not None:
        peak = context.units.peak
        driven = force.or_unit(file, context.units.level_unit).complex_values(file, level_si) * force.peak(peak)
        if (driven == 0).any():
            row = int(np.argmax(driven == 0))
            raise force.problem(f"is 0 at row {row + 1} of {file.path.name}: leave out what was not driven")
        return np.asarray(signal.complex_values(file, unit) * signal.peak(peak) / driven)
    if not (unit and level_si):
        return signal.complex_values(file, "")
    if signal.is_in(file, unit):
        raise signal.problem(
            f"is a response in {unit} or a multiple of it, not per {level_si}, and the force is missing: add "
            'force = "COLUMN" beside it, or give a response per force'
        )
    return signal.complex_values(file, f"({unit})/({level_si})")


def _read_coherence(signal: SignalEntry, file: MeasuredFile) -> Frequencies:
    values = signal.real_values(file, "")
    wrong = (values < 0) | (values > 1 + ROUNDED)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise signal.problem(
            f"is {values[row]:g} at row {row + 1} of {file.path.name}: a coherence is between 0 and 1; name its column"
        )
    return np.minimum(values, 1.0)


def _estimate(
    table: TomlTable,
    own: Mapping[str, SignalEntry],
    signals: Mapping[str, SignalEntry],
    file: MeasuredFile,
    sensors: Sequence[MeasuredSensor],
    context: DataContext,
) -> tuple[FrequencyResponse, Excitation]:
    """Estimate the frequency responses of a record, and return them with the kind of excitation."""
    if "force" not in own:
        raise table.problem("columns.force", 'is missing: add force = "COLUMN", the channel that drives', show=False)
    kinds = [kind.value for kind in Excitation]
    block = table.converted("block", lambda value: read_si_quantity(value, "s"), np.nan)
    excitation = Excitation(table.choice("excitation", kinds)) if "excitation" in table.values else Excitation.RANDOM
    result = estimate_frequency_response(
        own["time"].or_unit(file, "s").real_values(file, "s"),
        own["force"].or_unit(file, context.units.level_unit).real_values(file, context.units.level_si),
        np.array([signals[item.name].real_values(file, item.unit if item.calibrated else "") for item in sensors]),
        excitation=excitation,
        block=None if np.isnan(block) else block,
    )
    return result, excitation


def list_states(response: MeasuredResponse, sensors: Sequence[str]) -> Measurement | None:
    """Convert a response to steady states of its level; None without a level.

    States are spread evenly along the curves of log H in the complex plane, so that most of them are at resonances.

    Parameters
    ----------
    response
        Measured responses.
    sensors
        Names of all sensors of the campaign; rows hold their indices.
    """
    if response.level is None:
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        curve = np.log(np.where(response.value == 0, np.nan, response.value))
    curve.imag[:] = np.unwrap(np.nan_to_num(curve.imag))
    noise = np.array([_estimate_relative_noise(response.frequency, row) for row in response.value])
    # Noise would move all states to the smallest responses: the part of a step that noise explains is subtracted, and
    # only steps between coherent points are counted.
    step, chance = np.nan_to_num(np.abs(np.diff(curve, axis=1))), np.hypot(noise[:, 1:], noise[:, :-1])
    step = np.maximum(step - chance**2 / np.where(step > 0, step, np.inf), 0.0).max(axis=0)
    coherence = np.minimum(response.coherence, 1 / (1 + noise**2))
    # A line is coherent only with its neighbours: among many noisy lines, some are large by chance.
    coherent = np.asarray(binary_erosion(np.asarray((coherence >= COHERENT).all(axis=0)), border_value=1))
    way = np.concatenate([[0.0], np.cumsum(step * (coherent[1:] & coherent[:-1]))])
    wanted = np.linspace(0, way[-1], MOST_STATES)
    chosen = np.unique(np.searchsorted(way, wanted).clip(max=len(way) - 1))
    chosen = chosen[coherent[chosen]]
    value = response.value[:, chosen]
    row, state = np.nonzero(np.isfinite(value))
    one = np.ones(len(row), dtype=np.int64)
    return Measurement(
        test=response.test * one,
        order=state,
        repeat=response.repeat * one,
        sweep=0 * one,
        level=np.full(len(row), float(response.level)),
        frequency=response.frequency[chosen[state]],
        sensor=np.array([sensors.index(name) for name in response.sensors])[row],
        harmonic=one,
        value=response.level * value[row, state],
    )


def _estimate_relative_noise(frequency: Frequencies, value: Complex[NDArray[np.complex128], " f"]) -> Frequencies:
    """Noise of a curve relative to its values, shape (f,) [-]; the coherence of few averages does not show it."""
    there, result = np.isfinite(value) & (value != 0), np.zeros(len(value))
    deviation, _ = estimate_curve_noise(frequency[there], value[there])
    result[there] = np.sqrt(2) * np.nan_to_num(deviation) / np.abs(value[there])
    return result


def compute_response_features(response: MeasuredResponse) -> Features:
    """Frequencies and damping ratios of the modes of the responses, as features."""
    modes = response.modes
    label = [
        f"{words} of mode {number}" for number in range(1, len(modes) + 1) for words in ("frequency", "damping ratio")
    ]
    value = [(mode.frequency, mode.damping) for mode in modes]
    deviation = [(mode.frequency_deviation, mode.damping_deviation) for mode in modes]
    return Features(
        label=tuple(label), unit=("Hz", "-") * len(modes), value=np.ravel(value), deviation=np.ravel(deviation)
    )


def predict_response(model: Model, response: MeasuredResponse) -> Float[NDArray[np.float64], " m"]:
    """Frequencies and damping ratios of the paired linear modes of the model, shape (m,); NaN without a pair.

    Raises
    ------
    CampaignError
        The model has no motion sensor with the name of a sensor of a mode.
    """
    # Mistakes such as swapped sensors must not affect the pairing of modes.
    parts = [predict_mode(model, mode) for mode in correct_modes(model, response.modes)]
    return np.concatenate(parts) if parts else np.zeros(0)


def make_response_panels(model: Model, response: MeasuredResponse) -> list[Panel]:
    """Panels with the modulus of the response of each sensor and of the linear model with its closed contacts stuck."""
    predicted, there = predict_linear_response(model, response), np.isfinite(response.value)
    return [
        Panel(
            title=f"{response.name}: {name}",
            x_label="frequency [Hz]",
            y_label=f"|H| [{response.units[row]}]",
            measured=((response.frequency[there[row]], np.abs(response.value[row, there[row]])),),
            predicted=((response.frequency, np.abs(predicted[row])),),
            is_curve=True,
            log_y=True,
        )
        for row, name in enumerate(response.sensors)
    ]


DATA_TYPES.register(
    DataType(
        name=MeasuredResponse.type,
        table="frf",
        holds="frequency responses, or records to estimate them from",
        read=read_frequency_response,
        features=compute_response_features,
        predict=predict_response,
        states=list_states,
        panels=make_response_panels,
    )
)
