"""Measured natural frequencies and damping ratios, with shapes if several sensors measured them.

They are compared with the linear modes of the model, free of its contacts or with all closed contacts stuck. A measured
mode with a shape is paired with the mode of the model with the best modal assurance criterion (MAC) times nearness in
frequency, a mode without a shape with the nearest frequency: a wrong pair cannot be detected without a shape.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import CONFIGURATIONS
from correlation.campaign.measurement_unit import read_positive_si_quantity
from correlation.campaign.toml_table import TomlTable
from correlation.data_type.registry import DATA_TYPES, DataContext, DataType, Features
from correlation.errors import CampaignError
from correlation.modal.pairing import score_pairs
from correlation.model import DERIVATIVE, Model, Sensor
from fe.dense_modes import compute_dense_modes
from geometry.read_only_array import freeze_fields
from reduction.jointed_system import modal_damping
from reduction.stuck import stick_at_rest

#: Default standard deviations of a frequency and of a damping ratio, relative [-]: a careful modal test on a bench
#: repeats frequencies to a few parts in ten thousand and damping to a tenth.
FREQUENCY_DEVIATION, DAMPING_DEVIATION = 5e-4, 0.1
#: Largest ratio of the frequencies of a measured mode and a mode of the model that are paired [-].
MAX_FREQUENCY_FACTOR = 1.5


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredMode:
    """Measured mode.

    Parameters
    ----------
    name
        Name in the manifest.
    configuration
        "jointed", or "free" of all contacts.
    frequency, frequency_deviation
        Natural frequency and its standard deviation [Hz].
    damping, damping_deviation
        Damping ratio and its standard deviation [-]; NaN if it was not measured.
    sensors
        Names of the sensors of the shape; empty without a shape.
    shape
        Mode shape at the sensors, in their quantities, shape (c,) [up to one complex factor].
    held_out
        Whether it is held out of calibrations.
    """

    type: ClassVar[str] = "mode"
    name: str
    configuration: str
    frequency: float
    frequency_deviation: float
    damping: float = np.nan
    damping_deviation: float = np.nan
    sensors: tuple[str, ...] = ()
    shape: Complex[NDArray[np.complex128], " c"] = field(default_factory=lambda: np.zeros(0, dtype=np.complex128))
    held_out: bool = False

    def __post_init__(self) -> None:
        freeze_fields(self, "shape", kind=np.complex128)


def read_mode(table: TomlTable, context: DataContext) -> MeasuredMode:
    """Read a ``[[mode]]`` of a manifest.

    Raises
    ------
    CampaignError
        A key or value cannot be used, or a sensor of the shape does not exist.
    """
    frequency = table.converted("frequency", partial(read_positive_si_quantity, si="Hz"), example="122.25 Hz")
    damping = table.converted("damping", partial(read_positive_si_quantity, si=""), np.nan)
    shape = table.take("shape", dict, {})
    known = {sensor.name for sensor in context.sensors}
    for sensor, value in shape.items():
        if sensor not in known:
            raise table.problem("shape", f'"{sensor}" is not a [[sensor]]: add one, or remove it', show=False)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise table.problem("shape", f"{sensor} = {value!r} must be a number", show=False)
    if len(shape) == 1:
        raise table.problem("shape", "has one sensor: a shape needs two; remove it", show=False)
    mode = MeasuredMode(
        name=table.take("name", str),
        configuration=table.choice("configuration", CONFIGURATIONS),
        frequency=frequency,
        frequency_deviation=table.converted(
            "frequency_deviation", partial(read_positive_si_quantity, si="Hz"), FREQUENCY_DEVIATION * frequency
        ),
        damping=damping,
        damping_deviation=table.converted(
            "damping_deviation", partial(read_positive_si_quantity, si=""), DAMPING_DEVIATION * damping
        ),
        sensors=tuple(shape),
        shape=np.array([*shape.values()], dtype=np.complex128),
        held_out=table.take("held_out", bool, False),
    )
    table.finish()
    return mode


def compute_mode_features(mode: MeasuredMode) -> Features:
    """Frequency and, if it was measured, damping ratio of a mode, as features."""
    label, unit = ["frequency"], ["Hz"]
    value, deviation = [mode.frequency], [mode.frequency_deviation]
    if np.isfinite(mode.damping):
        label, unit = [*label, "damping ratio"], [*unit, "-"]
        value, deviation = [*value, mode.damping], [*deviation, mode.damping_deviation]
    return Features(label=tuple(label), unit=tuple(unit), value=np.array(value), deviation=np.array(deviation))


def predict_mode(model: Model, mode: MeasuredMode) -> Float[NDArray[np.float64], " m"]:
    """Frequency and damping ratio of the paired mode of the model, shape (m,); NaN if there is none.

    Raises
    ------
    CampaignError
        The model has no motion sensor with the name of a sensor of the shape.
    """
    frequency, damping, shapes = compute_linear_modes(model, mode.configuration)
    partner = find_partner(model, mode, frequency, shapes)
    value = [frequency[partner], damping[partner]] if partner is not None else [np.nan, np.nan]
    return np.array(value[: 2 if np.isfinite(mode.damping) else 1])


def compute_linear_modes(
    model: Model, configuration: str
) -> tuple[Float[NDArray[np.float64], " m"], Float[NDArray[np.float64], " m"], Float[NDArray[np.float64], "r m"]]:
    """Frequencies [Hz], damping ratios [-] and shapes, shape (r, m), of the model with its closed contacts stuck."""
    system = model.in_configuration(configuration).system
    modes = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints))
    omega = np.sqrt(np.maximum(modes.lambda_, 0.0))
    shapes = modes.mode_shapes
    rate = modal_damping(system, shapes, omega)
    with np.errstate(divide="ignore", invalid="ignore"):
        damping = np.where(omega > 0, rate / (2 * omega), np.nan)
    shift = 1 + model.frequency_shift.get(configuration, 0.0)
    return omega / (2 * np.pi) / shift, damping, shapes


def find_partner(
    model: Model,
    mode: MeasuredMode,
    frequency: Float[NDArray[np.float64], " m"],
    shapes: Float[NDArray[np.float64], "r m"],
) -> int | None:
    """Index of the mode of the model that is paired with a measured mode; None if there is none.

    Parameters
    ----------
    model
        Model with the sensors.
    mode
        Measured mode.
    frequency, shapes
        Modes of the model, shape (m,) [Hz] and (r, m).

    Raises
    ------
    CampaignError
        The model has no motion sensor with the name of a sensor of the shape.
    """
    near = (frequency < MAX_FREQUENCY_FACTOR * mode.frequency) & (frequency > mode.frequency / MAX_FREQUENCY_FACTOR)
    if not near.any():
        return None
    candidates = np.flatnonzero(near)
    if not mode.sensors:
        return int(candidates[np.argmin(np.abs(np.log(frequency[candidates] / mode.frequency)))])
    seen = shape_at_sensors(model, mode.sensors, frequency[candidates], shapes[:, candidates])
    projection = np.abs(mode.shape.conj() @ seen) ** 2
    size = (np.abs(seen) ** 2).sum(axis=0) * (np.abs(mode.shape) ** 2).sum()
    with np.errstate(divide="ignore", invalid="ignore"):
        score = score_pairs((projection / size)[None, :], np.array([mode.frequency]), frequency[candidates])[0]
        return int(candidates[np.argmax(np.where(size > 0, score, -1.0))])


def shape_at_sensors(
    model: Model,
    sensors: tuple[str, ...],
    frequency: Float[NDArray[np.float64], " m"],
    shapes: Float[NDArray[np.float64], "r m"],
) -> Complex[NDArray[np.complex128], "c m"]:
    """Mode shapes at sensors, in the quantities of the sensors, shape (c, m)."""
    return np.array(
        [
            sensor.gain * (sensor.row @ shapes) * (2j * np.pi * frequency) ** DERIVATIVE[sensor.quantity]
            for sensor in list_motion_sensors(model, sensors)
        ]
    )


def list_motion_sensors(model: Model, names: Sequence[str]) -> list[Sensor]:
    """Motion sensors of a model by name.

    Raises
    ------
    CampaignError
        The model has no motion sensor of one of the names.
    """
    own = {sensor.name: sensor for sensor in model.sensors if isinstance(sensor, Sensor)}
    for name in names:
        if name not in own:
            raise CampaignError(f'the model has no sensor of motion "{name}": add it to the case')
    return [own[name] for name in names]


DATA_TYPES.register(
    DataType(
        name=MeasuredMode.type,
        table="mode",
        holds="natural frequencies with damping ratios and shapes",
        read=read_mode,
        features=compute_mode_features,
        predict=predict_mode,
        states=None,
        panels=None,
    )
)
