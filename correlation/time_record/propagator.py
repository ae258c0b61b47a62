"""State-space propagator of a model over one time step, with the laws of its joints and the rows of its sensors.

A record drives the model along the force of a level of 1 N; the numbers of the force channel multiply it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, expm

from correlation.errors import ModelDefinitionError
from correlation.model import DERIVATIVE, LineSensor, LoadCell, Model
from hbsolve.joint_arrays import InstantTable, make_instant_table
from reduction.joint_law.registry import Joint

Array = Float[NDArray[np.float64], "..."]

#: Inputs before those of the joints: the force, and the 1 that carries the static load. It takes part in compiled code
#: (fe.compiled keeps track of this file by these words).
BEFORE = 2
#: Fields that do not depend on parameters.
SHARED = ("joint_rows", "table")


class Propagator(NamedTuple):
    """Matrices of x_{k+1} = phi x_k + gamma_0 w_k + gamma_1 w_{k+1}, of the joints' motions and of the sensors.

    Parameters
    ----------
    phi, gamma0, gamma1
        Shapes (n, n), (n, m), (n, m); n = 2 r, m = 2 + joints.
    joint_rows
        Displacements, then velocities of the joints by the state, shape (2 joints, n).
    table, law
        Laws of the joints and their parameters, shape (joints, m).
    output, feedthrough
        Rows of each sensor over the state and over the inputs, shapes (s, n) and (s, m).
    """

    phi: Array
    gamma0: Array
    gamma1: Array
    joint_rows: Array
    table: InstantTable
    law: Array
    output: Array
    feedthrough: Array

    def rate(self, other: "Propagator", step: float) -> "Propagator":
        """(other - self) / step of all numbers.

        Raises
        ------
        ModelDefinitionError
            Other joints, or joints with other directions.
        """
        if self.joint_rows.shape != other.joint_rows.shape or not np.array_equal(self.joint_rows, other.joint_rows):
            raise ModelDefinitionError(
                "a parameter changes the number or direction of joints: only their numbers may change"
            )
        names = [name for name in self._fields if name not in SHARED]
        return self._replace(**{name: (getattr(other, name) - getattr(self, name)) / step for name in names})


def make_propagator(model: Model, sensors: tuple[str, ...], step: float) -> Propagator:
    """Compute the propagator of a model.

    Parameters
    ----------
    model
        Model with springs, stops and dampers as joints.
    sensors
        Names of those that are read.
    step
        Time step [s].

    Raises
    ------
    ModelDefinitionError
        A joint with memory, a force that no record can drive, a sensor that is not there or reads a contact line,
        or a mass matrix that is not positive definite.
    """
    system, r = model.system, model.system.n_dof
    if system.structural_damping is not None:
        raise ModelDefinitionError(
            "the model has structural damping (a loss factor), which has no force in time: give it as viscous damping "
            "for time records"
        )
    _check_memory(system.joints)
    table = make_instant_table(system.joints)
    directions = np.array([joint.directions[0] for joint in system.joints]).reshape(-1, r)
    # Columns: the force, the static load, the joints.
    loads = np.column_stack([_make_load(model), system.static, -directions.T])
    try:
        solved = cho_solve(cho_factor(system.mass), np.column_stack([system.stiffness, system.damping, loads]))
    except LinAlgError as error:
        raise ModelDefinitionError(
            "the mass matrix is not positive definite: give every degree of freedom a mass, or reduce the model"
        ) from error
    n, m = 2 * r, loads.shape[1]
    acceleration, inertance = np.column_stack([-solved[:, :r], -solved[:, r:n]]), solved[:, n:]
    state = np.vstack([np.eye(r, n, r), acceleration])
    augmented = np.zeros((n + 2 * m, n + 2 * m))
    augmented[:n, :n] = step * state
    augmented[r:n, n : n + m] = step * inertance
    augmented[n : n + m, n + m :] = np.eye(m)
    exponential = expm(augmented)
    gamma1 = exponential[:n, n + m :]
    rows = [_make_sensor_row(model, name) for name in sensors]
    output, feedthrough = np.zeros((len(rows), n)), np.zeros((len(rows), m))
    for number, (row, derivative) in enumerate(rows):
        if derivative == DERIVATIVE["acceleration"]:
            output[number], feedthrough[number] = row @ acceleration, row @ inertance
        else:
            output[number, derivative * r : (derivative + 1) * r] = row
    zeros = np.zeros_like(directions)
    return Propagator(
        phi=exponential[:n, :n],
        gamma0=exponential[:n, n : n + m] - gamma1,
        gamma1=gamma1,
        joint_rows=np.vstack([np.hstack([directions, zeros]), np.hstack([zeros, directions])]),
        table=table,
        law=table.value,
        output=output,
        feedthrough=feedthrough,
    )


def _check_memory(joints: Sequence[Joint]) -> None:
    for joint in joints:
        if joint.n_slider or len(joint.directions) > 1:
            raise ModelDefinitionError(
                f'joint "{joint.name}" ({joint.kind}) acts along several rows, or has sliders whose initial '
                "positions are unknown: fit records of a model with springs, stops and dampers, or measure steady "
                "states"
            )


def _make_load(model: Model) -> Array:
    """Load vector of the force of a record, shape (r,) [N/N]."""
    dynamic = model.system.dynamic
    higher = [k for k in range(2, len(dynamic)) if dynamic[k].any()]
    if higher:
        raise ModelDefinitionError(
            f"the model has a force of harmonic {higher[0]}: a record drives it by one force alone"
        )
    if len(dynamic) < 2:
        return np.zeros(model.system.n_dof)
    if dynamic[1].imag.any():
        raise ModelDefinitionError(
            "the force of 1 N has an imaginary part: a record drives all points in phase, make it real"
        )
    return np.array(dynamic[1].real)


def _make_sensor_row(model: Model, name: str) -> tuple[Array, int]:
    """Row with the gain, and how many time derivatives it takes."""
    for item in model.sensors:
        if item.name == name:
            if isinstance(item, LineSensor):
                raise ModelDefinitionError(
                    f'sensor "{name}" reads the contact line "{item.line}": records are of motion'
                )
            if isinstance(item, LoadCell):
                raise ModelDefinitionError(f'sensor "{name}" is a load cell: records are of motion')
            return item.gain * item.row, DERIVATIVE[item.quantity]
    known = ", ".join(item.name for item in model.sensors) or "none"
    raise ModelDefinitionError(f'the model has no sensor "{name}", which the record has: it has {known}')
