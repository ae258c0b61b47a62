"""Numbers of joint laws that contradict each other, one sentence each; bounds of single ones are in test_laws.py."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from reduction.errors import JointError
from reduction.jointed_system import (
    BoucWenJoint,
    DampedStop,
    FrictionEllipse,
    JenkinsChain,
    LuGreFriction,
    ValanisJoint,
)

ONE: dict[str, Any] = {"name": "j", "direction": np.ones(1)}
YIELD = {**ONE, "tangential_stiffness": 2.0, "limit_force": 1.0}
BRISTLES = {**ONE, "tangential_stiffness": 2.0, "velocity": 1.0}
STOP = {**ONE, "stiffness": 1.0, "damping": 1.0, "depth": 1.0}
AXES = {
    "name": "j", "normal": np.ones(3), "normal_stiffness": 1.0, "tangential_stiffness": 1.0,
    "second_tangential_stiffness": 1.0, "friction_coefficient": 0.3, "second_friction_coefficient": 0.2,
}  # fmt: skip


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: JenkinsChain(**ONE, tangential_stiffness=[], limit_force=[]),
            ["at least one number"],
        ),
        (lambda: JenkinsChain(**ONE, tangential_stiffness=[1, 2], limit_force=[1]), ["2 numbers", "limit_force 1"]),
        (lambda: JenkinsChain(**ONE, tangential_stiffness=[[1, 2]], limit_force=[1]), ["(1, 2)"]),
        (lambda: JenkinsChain(**ONE, tangential_stiffness=[1, -2], limit_force=[1, 1]), ["stiffness[1] = -2"]),
        (lambda: JenkinsChain(**ONE, tangential_stiffness=[1, 2], limit_force=[np.nan, 1]), ["limit_force[0]"]),
        (lambda: BoucWenJoint(**YIELD, exponent=0.5), ["exponent = 0.5", "at least 1"]),
        (lambda: BoucWenJoint(**YIELD, exponent=2.0, shape=0.2), ["shape = 0.2", "at least 0.5"]),
        (lambda: BoucWenJoint(**YIELD, exponent=2.0, slip_stiffness=2.0), ["slip_stiffness = 2", "below"]),
        (lambda: ValanisJoint(**YIELD, kappa=1.0), ["kappa = 1", "below 1"]),
        (lambda: LuGreFriction(**BRISTLES, limit_force=2.0, static_force=1.0), ["static_force = 1", "at least"]),
        (lambda: DampedStop(**STOP, sides="none"), ["sides = 'none'", "both"]),
        (lambda: DampedStop(**STOP, sides="both", gap=-0.1), ["gap = -0.1", "negative"]),
        (
            lambda: FrictionEllipse(**AXES, tangent=np.ones(3), second_tangent=np.ones(2)),
            ["3 degrees of freedom", "3 and 2"],
        ),
        (
            lambda: FrictionEllipse(
                **(AXES | {"second_friction_coefficient": 0.0}), tangent=np.ones(3), second_tangent=np.ones(3)
            ),
            ["second_friction_coefficient = 0"],
        ),
        (
            lambda: FrictionEllipse(
                **(AXES | {"second_friction_coefficient": 40}), tangent=np.ones(3), second_tangent=np.ones(3)
            ),
            ["second_friction_coefficient = 40", "percent"],
        ),
    ],
)
def test_what_a_law_refuses(make: Callable[[], object], words: list[str]) -> None:
    with pytest.raises(JointError) as error:
        make()
    for word in ['"j"', *words]:
        assert word in str(error.value)
