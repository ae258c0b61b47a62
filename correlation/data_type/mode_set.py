"""Sets of measured modes with shapes at the same sensors, and the modes of a model near them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.data_type.mode import (
    MAX_FREQUENCY_FACTOR,
    MeasuredMode,
    compute_linear_modes,
    list_motion_sensors,
    shape_at_sensors,
)
from correlation.modal.sensor_mistake import SensorMistake, find_sensor_mistake
from correlation.model import Model


@dataclass(frozen=True, kw_only=True, eq=False)
class ComparedModes:
    """Measured modes and the modes of the model near them.

    Parameters
    ----------
    configuration, sensors
        Configuration and sensors of all modes.
    modes
        Measured modes by rising frequency.
    frequency, damping
        Natural frequencies and damping ratios of the model, shape (m,) [Hz, -].
    model_shape
        Mode shapes of the model at the sensors, shape (c, m).
    mistake
        Sensor mistake whose correction makes the shapes agree; None if there is none.
    """

    configuration: str
    sensors: tuple[str, ...]
    modes: tuple[MeasuredMode, ...]
    frequency: Float[NDArray[np.float64], " m"]
    damping: Float[NDArray[np.float64], " m"]
    model_shape: Complex[NDArray[np.complex128], "c m"]
    mistake: SensorMistake | None

    @property
    def shape(self) -> Complex[NDArray[np.complex128], "c n"]:
        """Measured shapes, shape (c, n)."""
        return np.array([mode.shape for mode in self.modes]).T

    @property
    def corrected_shape(self) -> Complex[NDArray[np.complex128], "c n"]:
        """Measured shapes after correction of the sensor mistake, for the pairing of modes, shape (c, n)."""
        return self.shape if self.mistake is None else np.asarray(self.mistake.correct(self.shape))


def group_modes(model: Model, modes: Sequence[MeasuredMode]) -> Iterator[ComparedModes]:
    """Group modes with shapes by configuration and sensors; a group without modes of the model nearby is left out.

    Raises
    ------
    CampaignError
        The model has no motion sensor with the name of a sensor of a shape.
    """
    groups: dict[tuple[str, tuple[str, ...]], list[MeasuredMode]] = {}
    for mode in modes:
        if mode.sensors:
            groups.setdefault((mode.configuration, mode.sensors), []).append(mode)
    for (configuration, sensors), own in groups.items():
        measured = sorted(own, key=lambda mode: mode.frequency)
        frequency, damping, shapes = compute_linear_modes(model, configuration)
        near = (frequency > measured[0].frequency / MAX_FREQUENCY_FACTOR) & (
            frequency < measured[-1].frequency * MAX_FREQUENCY_FACTOR
        )
        seen = shape_at_sensors(model, sensors, frequency[near], shapes[:, near])
        visible = np.abs(seen).max(axis=0, initial=0.0) > 0
        frequency, damping, seen = frequency[near][visible], damping[near][visible], seen[:, visible]
        if not len(frequency):
            continue
        mistake = find_sensor_mistake(
            np.array([mode.frequency for mode in measured]), np.array([mode.shape for mode in measured]).T,
            frequency, seen, [sensor.quantity for sensor in list_motion_sensors(model, sensors)],
        )  # fmt: skip
        yield ComparedModes(
            configuration=configuration, sensors=sensors, modes=tuple(measured), frequency=frequency,
            damping=damping, model_shape=seen, mistake=mistake,
        )  # fmt: skip


def correct_modes(model: Model, modes: Sequence[MeasuredMode]) -> list[MeasuredMode]:
    """Correct the sensor mistakes in the shapes of modes, in unchanged order."""
    corrected = {
        id(mode): replace(mode, shape=shape)
        for group in group_modes(model, modes)
        if group.mistake is not None
        for mode, shape in zip(group.modes, group.corrected_shape.T, strict=True)
    }
    return [corrected.get(id(mode), mode) for mode in modes]
