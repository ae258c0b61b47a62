"""What errors of the frequencies do to kt and density: closed forms of a mass on springs."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from correlation.model import Model, Sensor
from reduction.jointed_system import FrictionContact, JointedSystem
from study.paper.frequency_error import MIN_SLOPE, ROOT_DEVIATION, find_frequency_error
from study.paper.parameters import RigParameters

#: A mass on the springs of its root, with a contact of which the tangential stiffness counts.
PARAMETERS = RigParameters(kt=2e4, kn=1e6, mu=0.5, damping=2e-3, root=6e4, density=8000.0)
#: As large as what the root does, so that neither is lost in the other.
NUMERICAL = 2e-2
#: d ln f / d ln kt is half of the share of kt in the stiffness; a difference over 2 % is off by half of that.
SLOPE, DIFFERENCE = 2e4 / (2e4 + 6e4) / 2, 0.01
INPUTS: Any = "a mass"


def make_model(parameters: RigParameters) -> Model:
    assert parameters.density is not None
    contact = FrictionContact(
        name="pad", normal=np.array([0.0, 1.0]), tangents=np.array([[1.0, 0.0]]), normal_stiffness=parameters.kn,
        tangential_stiffness=parameters.kt, friction_coefficient=parameters.mu, preload=10.0,
    )  # fmt: skip
    system = JointedSystem(
        mass=np.diag([parameters.density, 1e-3]), damping=np.diag([1.0, 1.0]),
        stiffness=np.diag([parameters.root or 6e4, 1e9]), joints=[contact],
        static_load=np.array([0.0, 10.0]), harmonic_force=np.array([[0.0, 0.0], [1.0, 0.0]]),
    )  # fmt: skip
    sensors = (Sensor(name="tip", row=np.array([1.0, 0.0])),)
    return Model(system=system, sensors=sensors, lines={"pads": ("pad",)}, n_harmonic=1)


#: It stands for the models of a rig.
MAKE: Any = make_model


def test_kt_makes_up_for_numerical_error_and_the_root_as_the_closed_form_does() -> None:
    result = find_frequency_error.compute(INPUTS, PARAMETERS, NUMERICAL, 0.0, MAKE)
    # f^2 is (kt + root) / density; the density keeps the free root / density, so that only kt / density is left.
    assert result.density == pytest.approx(np.log(1 + ROOT_DEVIATION), rel=1e-6)  # eigenvalues are exact to round-off
    ratio = (2e4 + 6e4 * (1 + ROOT_DEVIATION)) / (2e4 + 6e4) / (1 + ROOT_DEVIATION)
    assert result.kt == pytest.approx(np.hypot(NUMERICAL, np.log(ratio) / 2) / SLOPE, rel=DIFFERENCE)


def test_without_a_free_resonance_all_of_the_root_is_in_kt() -> None:
    result = find_frequency_error.compute(INPUTS, PARAMETERS, NUMERICAL, None, MAKE)
    assert result.density == 0.0
    ratio = (2e4 + 6e4 * (1 + ROOT_DEVIATION)) / (2e4 + 6e4)
    assert result.kt == pytest.approx(np.hypot(NUMERICAL, np.log(ratio) / 2) / SLOPE, rel=DIFFERENCE)


def test_a_fixed_root_leaves_numerical_error_alone() -> None:
    # The chain stands on springs of the case then, which are not in doubt.
    result = find_frequency_error.compute(INPUTS, replace(PARAMETERS, root=None), NUMERICAL, 3e-3, MAKE)
    assert result.kt == pytest.approx(NUMERICAL / SLOPE, rel=DIFFERENCE)
    assert result.density == pytest.approx(6e-3, rel=1e-12)


def test_contacts_far_stiffer_than_the_structure_tell_nothing_of_kt() -> None:
    rigid = replace(PARAMETERS, kt=1e-9)
    result = find_frequency_error.compute(INPUTS, replace(rigid, root=None), NUMERICAL, None, MAKE)
    assert result.kt == pytest.approx(NUMERICAL / MIN_SLOPE)
