"""One degree of freedom with a joint: what its loops and backbones are in closed form."""

from collections.abc import Callable

import numpy as np
import pytest

from correlation.model import Model, Sensor
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.joint_law.jenkins import JenkinsElement
from reduction.joint_law.registry import Joint
from reduction.jointed_system import JointedSystem

MASS, STIFFNESS, RATIO = 1.3, 5e5, 0.004


@pytest.fixture(scope="session")
def oscillator() -> Callable[..., Model]:
    def make(*joints: Joint, n_harmonic: int = 12, ratio: float = RATIO) -> Model:
        system = JointedSystem(
            mass=[[MASS]], damping=[[2 * ratio * np.sqrt(STIFFNESS * MASS)]], stiffness=[[STIFFNESS]], joints=joints,
            static_load=np.zeros(1), harmonic_force=np.array([[0], [1.0]]),
        )  # fmt: skip
        row = np.ones(1)
        sensors = (Sensor(name="tip", row=row), Sensor(name="accelerometer", row=row, quantity="acceleration"))
        return Model(system=system, sensors=sensors, places={"tip": row}, n_harmonic=n_harmonic)

    return make


@pytest.fixture(scope="session")
def jenkins() -> JenkinsElement:
    return JenkinsElement(name="slider", direction=np.ones(1), tangential_stiffness=1e5, limit_force=4.0)


@pytest.fixture(scope="session")
def cubic() -> CubicSpring:
    return CubicSpring(name="cubic", direction=np.ones(1), stiffness=2e11)
