"""Resonances that tests are compared with: those that the force drives and a sensor sees."""

import numpy as np
import pytest

from correlation.model import Model, Sensor
from reduction.jointed_system import JointedSystem
from study.compare.suspicions import compute_model_frequencies


def test_a_body_that_no_force_drives_and_no_sensor_sees_has_no_resonance_here() -> None:
    # Two masses on springs of their own: 1 Hz, which nothing touches, and 10 Hz.
    omega = 2 * np.pi * np.array([1.0, 10.0])
    force = np.array([[0.0, 0.0], [0.0, 1.0]], dtype=complex)
    system = JointedSystem(
        mass=np.eye(2), damping=0.01 * np.eye(2), stiffness=np.diag(omega**2), joints=[], harmonic_force=force
    )
    rows = np.eye(2)
    result = {
        name: compute_model_frequencies(
            Model(system=system, sensors=(Sensor(name="a", row=row),), lines={}, places={}, n_harmonic=3)
        )
        for name, row in (("driven", rows[1]), ("both", rows.sum(axis=0)))
    }
    # The stuck and the free structure are the same.
    assert result["driven"] == pytest.approx([10.0, 10.0])
    assert result["both"] == pytest.approx([10.0, 10.0])
