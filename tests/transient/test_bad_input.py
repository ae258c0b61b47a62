"""Each bad input: one sentence with the value and the remedy."""

from typing import Any

import numpy as np
import pytest

from geometry.errors import InputError
from reduction.jointed_system import JenkinsElement, JointedSystem
from transient.errors import TransientError
from transient.history import Segment, follow
from transient.integrate import integrate
from transient.state import TransientState, start_from
from transient.steady import steady_motion


def system(**changes: Any) -> JointedSystem:
    values: dict[str, Any] = {
        "mass": np.eye(2),
        "damping": 0.1 * np.eye(2),
        "stiffness": np.eye(2),
        "joints": [JenkinsElement(name="j", direction=np.array([1.0, 0.0]), tangential_stiffness=1.0, limit_force=1.0)],
        "harmonic_force": np.array([[0, 0], [1.0, 0]]),
    }
    return JointedSystem(**{**values, **changes})


def start(displacement: int = 2, slider: int = 1, value: float = 0.0) -> TransientState:
    return TransientState(displacement=np.full(displacement, value), velocity=np.zeros(2), slider=np.zeros(slider))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"angular_frequency": 0.0}, r"angular_frequency = 0.0 rad/s must be positive"),
        ({"angular_frequency": np.nan}, r"angular_frequency = nan"),
        ({"n_period": 0}, r"n_period = 0 must be"),
        ({"n_period": 1.5}, r"n_period = 1.5 must be a whole number"),
        ({"steps_per_period": 4}, r"steps_per_period = 4 must be"),
        ({"level": np.inf}, r"level = inf"),
        ({"angular_frequency": "1"}, r"angular_frequency = '1' must be a real number"),
        ({"steps_per_period": 16.0}, r"steps_per_period = 16\.0 must be a whole number"),
        ({"level": "a"}, r"level = 'a' must be a real number"),
        ({"system": None}, r"the system is a NoneType: give a JointedSystem"),
        ({"keep": 1.5}, r"keep = 1\.5 must be a whole number"),
        ({"keep": 3}, r"keep = 3 must lie between 1 and n_period = 2"),
        ({"outputs": {"tip": np.zeros(3)}}, r'"tip" has shape \(3,\): give \(2,\)'),
        ({"start": start(displacement=3)}, r"displacement of the start has shape \(3,\): give \(2,\)"),
        ({"start": start(slider=2)}, r"slider of the start has shape \(2,\): give \(1,\)"),
        ({"start": start(value=np.nan)}, r"displacement of the start holds nan at 0: give finite"),
        ({"system": system(mass=np.diag([1.0, 0.0]))}, r"mass has the eigenvalue 0 kg"),
        ({"system": system(mass=np.diag([1.0, -2.0]))}, r"mass has the eigenvalue -2 kg"),
        (
            {"system": system(stiffness=np.array([[1.0, 0.5], [0.0, 1.0]]))},
            r"stiffness is not symmetric: .* 0\.5 and 0",
        ),
        ({"system": system(damping=np.diag([1.0, np.nan]))}, r"damping holds nan at \(1, 1\): give finite"),
        ({"system": system(stiffness=np.diag([1.0, 0.0]), static_load=np.ones(2))}, r"not supported"),
    ],
)
def test_integration_refuses(arguments: dict[str, Any], message: str) -> None:
    values: dict[str, Any] = {"system": system(), "angular_frequency": 1.0, "n_period": 2, "steps_per_period": 16}
    with pytest.raises(TransientError, match=message) as caught:
        integrate(**{**values, **arguments})
    assert isinstance(caught.value, InputError)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"tolerance": 0.0}, r"tolerance = 0.0 must lie between 0 and 1"),
        ({"step_tolerance": 2.0}, r"step_tolerance = 2.0"),
        ({"max_period": 0}, r"max_period = 0"),
        ({"acceleration": -1}, r"acceleration = -1"),
        ({"angular_frequency": "1"}, r"angular_frequency = '1' must be a real number"),
        ({"level": "a"}, r"level = 'a' must be a real number"),
        ({"max_period": 2.5}, r"max_period = 2\.5 must be a whole number"),
        ({"acceleration": "3"}, r"acceleration = '3' must be a whole number"),
        ({"steps_per_period": 256.0}, r"steps_per_period = 256\.0 must be a whole number"),
        ({"tolerance": "small"}, r"tolerance = 'small' must be a real number"),
        ({"system": None}, r"the system is a NoneType"),
        ({"max_steps_per_period": 100}, r"max_steps_per_period = 100 at least steps_per_period = 256"),
    ],
)
def test_steady_motion_refuses(arguments: dict[str, Any], message: str) -> None:
    values: dict[str, Any] = {"system": system(), "angular_frequency": 1.0}
    with pytest.raises(TransientError, match=message):
        steady_motion(**{**values, **arguments})


def test_a_history_refuses() -> None:
    with pytest.raises(TransientError, match="without segments"):
        follow(system(), [])
    with pytest.raises(TransientError, match="n_period = 0 of a segment"):
        Segment(n_period=0, angular_frequency=1.0)
    with pytest.raises(TransientError, match="load = nan"):
        Segment(n_period=1, angular_frequency=1.0, load=np.nan)


def test_coefficients_of_another_system_are_refused() -> None:
    with pytest.raises(TransientError, match=r"shape \(3, 5\): give \(n_harmonic, 2\)"):
        start_from(system(), 1.0, np.zeros((3, 5), dtype=complex))
