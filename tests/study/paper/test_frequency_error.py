"""What errors of the frequencies do to kt and density: closed forms of a mass on springs."""

from typing import Any

import numpy as np
import pytest

from correlation.model import Model, Sensor
from reduction.jointed_system import FrictionContact, JointedSystem
from study.paper.frequency_error import ROOT_DEVIATION, find_frequency_error
from study.paper.parameters import RigParameters

#: A mass on the springs of its root, with a contact of which the tangential stiffness counts.
PARAMETERS = RigParameters(kt=2e4, kn=1e6, mu=0.5, damping=2e-3, root=6e4, density=8000.0)
NUMERICAL = 1e-3
CASE: Any = "a mass"


def make_model(parameters: RigParameters) -> Model:
    assert parameters.root is not None
    assert parameters.density is not None
    contact = FrictionContact(
        name="pad", normal=np.array([0.0, 1.0]), tangents=np.array([[1.0, 0.0]]), normal_stiffness=parameters.kn,
        tangential_stiffness=parameters.kt, friction_coefficient=parameters.mu, preload=10.0,
    )  # fmt: skip
    system = JointedSystem(
        mass=np.diag([parameters.density, 1e-3]), damping=np.diag([1.0, 1.0]),
        stiffness=np.diag([parameters.root, 1e9]), joints=[contact],
        static_load=np.array([0.0, 10.0]), harmonic_force=np.array([[0.0, 0.0], [1.0, 0.0]]),
    )  # fmt: skip
    sensors = (Sensor(name="tip", row=np.array([1.0, 0.0])),)
    return Model(system=system, sensors=sensors, lines={"pads": ("pad",)}, n_harmonic=1)


def test_kt_makes_up_for_numerical_error_and_the_root_as_the_closed_form_does() -> None:
    result = find_frequency_error.compute(CASE, PARAMETERS, NUMERICAL, True, make_model)
    share = 2e4 / (2e4 + 6e4)
    # f^2 is (kt + root) / density; the density keeps the free root / density, so that only kt / density is left.
    assert result.density == pytest.approx(np.log(1 + ROOT_DEVIATION), rel=1e-6)
    ratio = (2e4 + 6e4 * (1 + ROOT_DEVIATION)) / (2e4 + 6e4) / (1 + ROOT_DEVIATION)
    # The slope is a difference over 2 %, which is half of that off.
    assert result.kt == pytest.approx(np.hypot(NUMERICAL, np.log(ratio) / 2) / (share / 2), rel=0.01)


def test_without_a_free_resonance_all_of_the_root_is_in_kt() -> None:
    result = find_frequency_error.compute(CASE, PARAMETERS, NUMERICAL, False, make_model)
    assert result.density == 0.0
    ratio = (2e4 + 6e4 * (1 + ROOT_DEVIATION)) / (2e4 + 6e4)
    assert result.kt == pytest.approx(np.hypot(NUMERICAL, np.log(ratio) / 2) / (0.25 / 2), rel=0.01)
