"""The driven resonance of small vibrations: its frequency and its damping ratio."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model, Sensor
from fe.dense_modes import compute_dense_modes
from reduction.jointed_system import JointedSystem, modal_damping
from reduction.stuck import stick_at_rest, stuck_stiffness

Row = Float[NDArray[np.float64], " r"]

#: A mode counts as driven above this share of the largest modal response [-]; the dampers roll in lower modes.
DRIVEN = 0.1
#: Number of the lowest modes among which the driven one is sought [-].
LOWEST = 20


@dataclass(frozen=True, kw_only=True)
class ModalPeak:
    """A resonance: its frequency [Hz] and damping ratio [-]."""

    frequency: float
    damping: float


def find_resonance(system: JointedSystem, row: Row) -> float:
    """Frequency of the first mode in which the force moves a sensor, all contacts stuck [Hz].

    Parameters
    ----------
    system
        Structure, joints and loads.
    row
        Row of the sensor, shape (r,) [-].
    """
    modes = compute_dense_modes(system.mass, stuck_stiffness(system.stiffness, system.joints))
    eigenvalue, shapes = modes.lambda_[:LOWEST], modes.mode_shapes[:, :LOWEST]
    moved = np.abs((row @ shapes) * (system.dynamic[1].real @ shapes)) / eigenvalue
    return float(np.sqrt(eigenvalue[np.argmax(moved > DRIVEN * moved.max())]) / (2 * np.pi))


def find_tip_row(model: Model) -> Float[NDArray[np.float64], " r"]:
    """Row of the sensor at the tip [-]."""
    return next(sensor.row for sensor in model.sensors if isinstance(sensor, Sensor) and sensor.name == "tip")


def find_small_peak(model: Model, *, free: bool) -> ModalPeak:
    """Resonance of small vibrations, of the free blade or with all contacts stuck.

    Parameters
    ----------
    model
        Model with the sensor "tip".
    free
        Whether without dampers.
    """
    system = (model.without_contacts() if free else model).system
    frequency = find_resonance(system, find_tip_row(model))
    modes = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints))
    own = int(np.argmin(np.abs(modes.frequency - frequency)))
    shape, omega = modes.mode_shapes[:, own], np.sqrt(modes.lambda_[[own]])
    ratio = modal_damping(system, shape[:, None], omega)[0] / (shape @ system.mass @ shape * 2 * omega[0])
    return ModalPeak(frequency=float(modes.frequency[own]), damping=float(ratio))


def scale_damping(model: Model, ratio: float) -> Model:
    """The model with its damping scaled to a damping ratio of the stuck resonance.

    Parameters
    ----------
    model
        Model with the sensor "tip" and some damping.
    ratio
        Damping ratio [-].
    """
    now = find_small_peak(model, free=False).damping
    return model.with_system(damping=ratio / now * model.system.damping)
