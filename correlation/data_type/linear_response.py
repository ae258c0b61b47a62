"""Frequency responses of the linear model with its closed contacts stuck."""

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.mode import list_motion_sensors
from correlation.model import DERIVATIVE, Model
from fe.dense_modes import compute_dense_modes
from reduction.stuck import stick_at_rest


def predict_linear_response(model: Model, response: MeasuredResponse) -> Complex[NDArray[np.complex128], "c f"]:
    """Response of the linear model at level 1, its closed contacts stuck, shape (c, f) [unit per unit of the level].

    Raises
    ------
    CampaignError
        The model has no motion sensor with the name of a sensor of the response.
    """
    configured = model.in_configuration(response.configuration)
    system = configured.system
    modes = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints))
    shapes = modes.mode_shapes
    # An exponential window shifts the Laplace variable along the real axis.
    omega = 2 * np.pi * response.frequency * (1 + model.frequency_shift.get(response.configuration, 0.0))
    s = response.decay + 1j * omega
    # Only the diagonal of the modal damping is used: coupling of modes is neglected, which holds for light damping.
    rate = np.einsum("rm,rs,sm->m", shapes, system.damping, shapes)
    loss = np.zeros_like(rate)
    if system.structural_damping is not None:
        loss = np.einsum("rm,rs,sm->m", shapes, system.structural_damping, shapes)
    force = shapes.T @ system.dynamic[1]
    motion = force[:, None] / (modes.lambda_[:, None] + s**2 + s * rate[:, None] + 1j * loss[:, None])
    sensors = list_motion_sensors(configured, response.sensors)
    relative = shapes @ motion
    rows = []
    for sensor in sensors:
        moved = sensor.row @ relative
        if configured.base_acceleration is not None and not sensor.relative:
            moved = moved + (configured.base_acceleration[1] @ sensor.row) / s**2
        rows.append(sensor.gain * moved * s ** DERIVATIVE[sensor.quantity] * np.exp(-s * sensor.delay))
    return np.array(rows)
