"""Parameters of joints beside contact lines are candidates, each of all joints of its group and of no other."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.candidate.catalogue import list_effects
from diagnosis.candidate.effect import EffectError
from reduction.jointed_system import IwanJoint, JenkinsElement
from study.case.setup import read_case
from study.shipped_cases import BEAM

MODEL = read_case(BEAM).setup.model
ROW = np.eye(MODEL.system.n_dof)[0]
LAP = {"direction": ROW, "tangential_stiffness": 1e3, "limit_force": 2.0, "exponent": -0.4, "ratio": 0.0}
JOINTS = [
    *(IwanJoint(name=f"bolt {number}", **LAP) for number in range(2)),
    JenkinsElement(name="bolt", direction=ROW, tangential_stiffness=1e3, limit_force=3.0),
]
WITH_JOINTS = replace(
    MODEL.with_system(joints=[*MODEL.system.joints, *JOINTS]),
    joint_groups={"lap": ("bolt 0", "bolt 1"), "bolt": ("bolt",)},
)
MODEL_WITH_RIVET = replace(MODEL, joint_groups={"rivet": ("rivet",)})


def read_numbers(model) -> dict[str, list[float]]:
    names = {joint.name for joint in JOINTS}
    return {item.name: list(item.parameter_values) for item in model.system.joints if item.name in names}


def test_each_parameter_that_gives_a_law_its_size_is_a_candidate() -> None:
    catalogue = list_effects(WITH_JOINTS)
    own = [name for name in catalogue.names if name.startswith(("lap.", "bolt."))]
    assert own == ["lap.tangential_stiffness", "lap.limit_force", "bolt.tangential_stiffness", "bolt.limit_force"]


def test_it_scales_all_joints_of_its_group_and_no_other() -> None:
    """The name of the one joint begins those of the others: a group is what the case says, not what names look like."""
    catalogue, before = list_effects(WITH_JOINTS), read_numbers(WITH_JOINTS)
    looser = read_numbers(catalogue.effect("bolt.limit_force").apply(WITH_JOINTS, [0.5]))
    assert looser == {**before, "bolt": [1e3, 1.5]}
    tighter = read_numbers(catalogue.effect("lap.limit_force").apply(WITH_JOINTS, [2.0]))
    assert tighter == {**before, **{name: [1e3, 4.0, -0.4, 0.0] for name in ("bolt 0", "bolt 1")}}


def test_a_parameter_of_zero_cannot_be_tested() -> None:
    free = WITH_JOINTS.with_joints({"bolt": {"limit_force": 0.0}})
    with pytest.raises(EffectError, match=r"bolt\.limit_force.*zero"):
        list_effects(free).effect("bolt.limit_force")


def test_a_group_of_joints_that_the_system_lacks_cannot_be_tested() -> None:
    (left,) = (item for item in list_effects(MODEL_WITH_RIVET).untestable if item.name == "joint parameter of rivet")
    assert "no joint of this name" in left.reason
