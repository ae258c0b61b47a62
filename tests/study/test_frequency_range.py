"""Frequencies above all natural frequencies of a model are doubted."""

from math import pi

import numpy as np
import pytest

from geometry.errors import InputWarning
from reduction.joint_law.jenkins import JenkinsElement
from reduction.jointed_system import JointedSystem
from study.solve.frequency_range import warn_of_high_frequency

#: 1 kg on 3 N/m and a slider of 1 N/m: 2 rad/s where it sticks.
SLIDER = JenkinsElement(name="slider", direction=np.array([1.0]), tangential_stiffness=1.0, limit_force=1.0)
SYSTEM = JointedSystem(
    mass=np.array([[1.0]]), damping=np.zeros((1, 1)), stiffness=np.array([[3.0]]), joints=(SLIDER,),
)  # fmt: skip


@pytest.mark.parametrize("asked", [(2.01, 2.5), (1.0, 2001.0), (2 * pi * 1e9,)])
def test_frequencies_at_which_only_inertia_is_left_are_doubted(asked: tuple[float, ...]) -> None:
    with pytest.warns(InputWarning, match=r"0\.3183 Hz"):  # 2 rad/s
        warn_of_high_frequency(SYSTEM, asked)


@pytest.mark.parametrize("asked", [(1.0, 1.99), (1.99, 1990.0), (0.0,), ()])
@pytest.mark.filterwarnings("error")
def test_a_range_that_begins_below_a_natural_frequency_is_not(asked: tuple[float, ...]) -> None:
    warn_of_high_frequency(SYSTEM, asked)
