"""Ring-downs: the free decay of a structure after a release or a blow, as frequency and damping against amplitude.

The backbone of each mode is identified from the decay (`correlation.signal.ring_down`) and compared with that of the
model (`correlation.data_type.backbone`) at a few amplitudes. The excitation need not be known.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measured_files import take_rows, without_padding
from correlation.campaign.measurement import CONFIGURATIONS
from correlation.campaign.measurement_unit import read_si_quantity
from correlation.campaign.signal_entry import read_signal
from correlation.campaign.toml_table import TomlTable
from correlation.data_type.backbone import predict_backbone
from correlation.data_type.indication import Indication
from correlation.data_type.registry import DATA_TYPES, DataContext, DataType, Features, Motion
from correlation.model import DERIVATIVE, Model, Sensor
from correlation.signal.clipped_decay import describe_clipping
from correlation.signal.decay_misfit import ENDS
from correlation.signal.record import note_rounded_time
from correlation.signal.ring_down import RingDown, analyse_ring_down, cut_decay
from geometry.read_only_array import freeze_fields

#: Number of amplitudes at which a mode is compared: neighbouring points of a backbone are not independent.
N_AMPLITUDE = 6
NO_MODES: tuple[float, ...] = ()
#: Smallest standard deviations, relative [-]: modes of a decay and resonances of a model differ by this much even
#: without scatter (frequency within a period of decay, damping of a slow change).
LEAST_FREQUENCY, LEAST_DAMPING = 1e-4, 0.02

#: Displacement from which a vibration on a bench is suspected to be in another unit [m].
LARGEST = 1.0
#: Relative difference in frequency below which two modes are the same; relative change below which a value is constant
#: [-].
SAME_MODE, STILL = 0.03, 1e-4
#: Kind of each trend, its name, and the factor and unit for its values in text.
TRENDS = (("frequency", "frequency", 1.0, "Hz"), ("damping", "damping ratio", 100.0, "%"))
Numbers = Float[NDArray[np.float64], " m"]
#: Configuration, unit, and the row of the sensor in the model, or its name if the model does not have it.
_Place: TypeAlias = tuple[str, str, tuple[float, ...] | str]


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeDecay:
    """Ring-down of one sensor.

    Parameters
    ----------
    name
        Name in the manifest.
    configuration
        "jointed", or "free" of all contacts.
    sensor
        Name of the sensor.
    modes
        Backbones of its modes.
    unit
        SI unit of the sensor.
    time, signal
        Record, shape (n,) [s, unit].
    held_out
        Whether it is held out of calibrations.
    """

    type: ClassVar[str] = "ring-down"
    name: str
    configuration: str
    sensor: str
    modes: tuple[RingDown, ...]
    unit: str
    time: Float[NDArray[np.float64], " n"]
    signal: Float[NDArray[np.float64], " n"]
    held_out: bool = False

    def __post_init__(self) -> None:
        freeze_fields(self, "time", "signal")

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of its sensors in the campaign."""
        return (self.sensor,)

    @property
    def suspicions(self) -> tuple[str, ...]:
        """Suspicions about the record, in words."""
        size = float(np.ptp(self.signal)) / 2 if len(self.signal) else 0.0
        clipped = describe_clipping(self.signal[self.time >= self._start])
        result = [f"{clipped}, which distorts frequency and damping: give a later start"] if clipped else []
        if self.unit == "m" and size >= LARGEST:
            result.append(
                f"its displacement is {size:.4g} m: are these raw values of a recorder? Frequency and damping depend "
                "on the amplitude: give its unit or sensitivity"
            )
        return tuple(result)

    @property
    def _start(self) -> float:
        """First instant from which a mode is identified [s]; -inf without modes."""
        return min((mode.start for mode in self.modes), default=-np.inf)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on how the record is read."""
        clipped: tuple[str, ...] = ()
        if (before := describe_clipping(self.signal)) and not describe_clipping(self.signal[self.time >= self._start]):
            read = f"it is read from {self._start:.4g} s on, and larger amplitudes are lost"
            clipped = (f"{before}; {read}: measure with a wider range",)
        of_modes = dict.fromkeys(text for mode in self.modes for text in mode.remarks)
        return (*note_rounded_time(self.time), *clipped, *of_modes)


def read_ring_down(table: TomlTable, context: DataContext) -> FreeDecay:
    """Read a ``[[ring_down]]`` of a manifest.

    Raises
    ------
    CampaignError
        A key or value cannot be used, the sensor is not calibrated, or the record has no decay.
    """
    return _read(table, context, partial(context.analyse, analyse_ring_down))


def check_ring_down(table: TomlTable, context: DataContext) -> FreeDecay:
    """Check a ``[[ring_down]]`` without the fit of its modes, which is slow."""

    def cut(*signals: Numbers, **words: Any) -> tuple[RingDown, ...]:
        cut_decay(*signals, **words)
        return ()

    return _read(table, context, cut)


def _read(table: TomlTable, context: DataContext, analyse: Callable[..., tuple[RingDown, ...]]) -> FreeDecay:
    sensors = {sensor.name: sensor for sensor in context.sensors}
    name = table.choice("sensor", sensors)
    sensor = sensors[name]
    if not sensor.calibrated:
        raise table.problem(
            "sensor",
            "is not calibrated: frequency and damping depend on the amplitude, which must be in SI; calibrate it",
        )
    columns = table.table("columns")
    time, value = read_signal(columns, "time"), read_signal(columns, "value")
    columns.finish()
    file = take_rows(
        table, context.files.read(table.take("file", str)), [*time.columns.values(), *value.columns.values()]
    )
    start, end = (table.converted(key, lambda value: read_si_quantity(value, "s"), np.nan) for key in ("start", "end"))
    near = table.converted("modes", _read_frequencies, NO_MODES)
    file = without_padding(file, time.columns.values())
    instants = time.or_unit(file, "s").real_values(file, "s")
    signal = value.real_values(file, sensor.unit)
    step = float(np.median(np.diff(instants))) if len(instants) > 1 else 0.0
    if near and step > 0 and max(near) * step >= 0.5:
        raise table.problem("modes", f"must be below half of the sampling rate, {0.5 / step:.6g} Hz")
    with table.reading(file.path.name):
        modes = analyse(
            instants,
            signal,
            quantity=sensor.quantity,
            start=None if np.isnan(start) else start,
            end=None if np.isnan(end) else end,
            frequencies=near or None,
        )
    decay = FreeDecay(
        name=table.take("name", str),
        configuration=table.choice("configuration", CONFIGURATIONS),
        sensor=name,
        modes=modes,
        unit=sensor.unit,
        time=instants,
        signal=signal,
        held_out=table.take("held_out", bool, False),
    )
    table.finish()
    return decay


def _read_frequencies(values: object) -> tuple[float, ...]:
    frequencies = tuple(read_si_quantity(value, "Hz") for value in (values if isinstance(values, list) else [values]))
    if not all(frequency > 0 for frequency in frequencies):
        raise ValueError("frequencies must be above zero")
    return frequencies


def compute_ring_down_features(decay: FreeDecay) -> Features:
    """Frequency and damping ratio of each mode at a few amplitudes."""
    label: list[str] = []
    unit: list[str] = []
    value: list[float] = []
    deviation: list[float] = []
    for mode in decay.modes:
        for row in choose_rows(mode):
            at = f"at {mode.amplitude[row]:.3g} {decay.unit}"
            label += [f"frequency {at}", f"damping ratio {at}"]
            unit += ["Hz", "-"]
            value += [float(mode.frequency[row]), float(mode.damping_ratio[row])]
            deviation += [
                float(np.hypot(mode.frequency_deviation[row], LEAST_FREQUENCY * mode.frequency[row])),
                float(np.hypot(mode.damping_deviation[row], LEAST_DAMPING * abs(mode.damping_ratio[row]))),
            ]
    return Features(label=tuple(label), unit=tuple(unit), value=np.array(value), deviation=np.array(deviation))


def predict_ring_down(model: Model, decay: FreeDecay) -> Float[NDArray[np.float64], " m"]:
    """Backbones of the model at the amplitudes of the features, shape (m,); NaN without a steady state.

    Raises
    ------
    CampaignError
        The model has no such sensor, or a mode is not visible at it.
    """
    configured = model.in_configuration(decay.configuration)
    predicted = []
    for mode in decay.modes:
        rows = choose_rows(mode)
        near = float(mode.frequency[np.argmin(mode.amplitude)])
        frequency, damping = predict_backbone(configured, decay.sensor, near, mode.amplitude[rows])
        predicted.append(np.column_stack([frequency, damping]).ravel())
    return np.concatenate(predicted) if predicted else np.zeros(0)


def list_ring_down_motions(model: Model, decay: FreeDecay) -> list[Motion]:
    """Row of the sensor and largest displacement of each mode."""
    sensor = next((item for item in model.sensors if item.name == decay.sensor), None)
    if not isinstance(sensor, Sensor):
        return []
    motions = []
    for mode in decay.modes:
        first = int(np.argmax(mode.amplitude))
        omega = 2 * np.pi * float(mode.frequency[first])
        size = float(mode.amplitude[first]) / abs(sensor.gain) / omega ** DERIVATIVE[sensor.quantity]
        motions.append((sensor.row, size))
    return motions


def list_ring_down_indications(
    model: Model, decays: Sequence[FreeDecay], predicted: Sequence[Numbers]
) -> list[Indication]:
    """Amplitude dependence of frequency and damping of each mode, over all decays at one place.

    Decays with and without contacts are of two structures, and the amplitudes of two places have no common scale.
    Channels of one place and quantity have a common scale, also under different names.

    Parameters
    ----------
    model
        Model.
    decays
        Measured decays.
    predicted
        Prediction of the features of each decay.
    """
    trends: dict[tuple[_Place, float], list[list[_Trend]]] = {}
    names: dict[_Place, dict[str, str]] = {}
    for decay, numbers in zip(decays, predicted, strict=True):
        first = 0
        place = _place(model, decay)
        names.setdefault(place, {})[decay.sensor] = decay.unit
        for mode in decay.modes:
            rows = choose_rows(mode)
            of_mode = numbers[first : first + 2 * len(rows)].reshape(-1, 2)
            first += 2 * len(rows)
            at = float(np.median(mode.frequency[rows]))
            known = next((key for key in trends if key[0] == place and abs(at / key[1] - 1) < SAME_MODE), (place, at))
            both = [
                _Trend.from_points(
                    mode.amplitude[rows], value[rows], np.hypot(deviation[rows], least * value[rows]), of_model
                )
                for value, deviation, least, of_model in (
                    (mode.frequency, mode.frequency_deviation, LEAST_FREQUENCY, of_mode[:, 0]),
                    (mode.damping_ratio, mode.damping_deviation, LEAST_DAMPING, of_mode[:, 1]),
                )
            ]
            trends.setdefault(known, []).append(both)
    indications = []
    for (place, frequency), of_decays in trends.items():
        first_name, *others = names[place]
        sensor = first_name + (f" and {len(others)} more" if others else "")
        for number, (kind, words, factor, unit_of) in enumerate(TRENDS):
            quantity = f"{words} of the {place[0]} mode at {frequency:.3g} Hz at {sensor}"
            own = [item[number] for item in of_decays]
            indications.append(_make_indication(kind, quantity, own, names[place][first_name], factor, unit_of))
    return indications


def _place(model: Model, decay: FreeDecay) -> _Place:
    """Key of decays with a common amplitude scale: configuration, unit, and the row of the sensor, or its name."""
    sensor = next((item for item in model.sensors if item.name == decay.sensor), None)
    reads = tuple((sensor.gain * sensor.row).tolist()) if isinstance(sensor, Sensor) else decay.sensor
    return decay.configuration, decay.unit, reads


class _Trend(NamedTuple):
    """Change of a value over the logarithm of the amplitude, from the smallest to the largest amplitude."""

    amplitude: tuple[float, float]
    measured: tuple[float, float]
    predicted: tuple[float, float]
    """Measured and predicted values at both amplitudes."""
    change: float
    """Measured change, of a straight line through all points."""
    apart: float
    """Measured less predicted change; NaN without a prediction."""
    variance: float
    """Variance of the measured change."""

    @classmethod
    def from_points(cls, amplitude: Numbers, value: Numbers, deviation: Numbers, predicted: Numbers) -> "_Trend":
        at, weight = np.log(amplitude), 1 / deviation**2
        from_centre = at - float(weight @ at / weight.sum())
        moment, span = float(weight @ from_centre**2), float(np.ptp(at))
        change, of_model = (span * float(weight @ (from_centre * item)) / moment for item in (value, predicted))
        least, largest = int(np.argmin(at)), int(np.argmax(at))
        amplitudes, measured, expected = (
            (float(item[least]), float(item[largest])) for item in (amplitude, value, predicted)
        )
        return cls(amplitudes, measured, expected, change, change - of_model, span**2 / moment)


def _make_indication(
    kind: str, quantity: str, trends: Sequence[_Trend], unit: str, factor: float, unit_of: str
) -> Indication:
    """Indication of the mean trend of several decays; their scatter is used if it exceeds their deviations."""
    measured, predicted, change, apart = (
        np.array([getattr(item, name) for item in trends]) for name in ("measured", "predicted", "change", "apart")
    )
    n = len(trends)
    variance = float(np.mean([item.variance for item in trends])) / n
    if n > 1:
        variance = max(variance, float(np.var(apart, ddof=1)) / n)
    low, high = (float(np.mean([item.amplitude[end] for item in trends])) for end in (0, 1))

    def words(ends: NDArray[np.float64]) -> str:
        first, last = factor * np.mean(ends, axis=0)
        if not np.isfinite(first + last):
            return "is not known"
        way = "stays" if abs(last - first) < STILL * abs(first) else "rises from" if last > first else "falls from"
        return f"stays at {first:.4g} {unit_of}" if way == "stays" else f"{way} {first:.4g} to {last:.4g} {unit_of}"

    difference = float(np.mean(np.where(np.isfinite(apart), apart, change))) / np.sqrt(variance)
    return Indication(
        quantity=quantity, kind=kind, difference=difference, predicted=words(predicted),
        measured=f"{words(measured)} from {low:.2g} to {high:.2g} {unit}",
    )  # fmt: skip


def choose_rows(mode: RingDown) -> NDArray[np.int64]:
    """Rows of a backbone that are compared, by falling amplitude, even in its logarithm, shape (up to 6,)."""
    first, last = np.log(mode.amplitude[0]), np.log(mode.amplitude[-1])
    wanted = np.linspace(first + ENDS * (last - first), last - ENDS * (last - first), N_AMPLITUDE)
    rows = [int(np.argmin(np.abs(np.log(mode.amplitude) - item))) for item in wanted]
    return np.array(list(dict.fromkeys(rows)))


DATA_TYPES.register(
    DataType(
        name=FreeDecay.type,
        table="ring_down",
        holds="free decays over time",
        read=read_ring_down,
        features=compute_ring_down_features,
        predict=predict_ring_down,
        states=None,
        panels=None,
        indications=list_ring_down_indications,
        motions=list_ring_down_motions,
        check=check_ring_down,
    )
)
