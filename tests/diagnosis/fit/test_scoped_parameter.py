"""A calibration parameter of one line, joint or part changes that one, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.model import StructurePart
from diagnosis.candidate.contact_line import find_contacts
from diagnosis.candidate.effect import EffectError
from diagnosis.candidate.joint_parameter import find_joints
from diagnosis.fit.scoped_parameter import make_scoped_parameter
from reduction.jointed_system import IwanJoint, JenkinsChain, ValanisJoint
from study.case.setup import read_case
from study.shipped_cases import BEAM

MODEL = read_case(BEAM).setup.model
ROW = np.eye(MODEL.system.n_dof)[0]
CHAIN = JenkinsChain(name="chain", direction=ROW, tangential_stiffness=(1e3, 2e3), limit_force=(1.0, 3.0))
IWAN = {"direction": ROW, "tangential_stiffness": 1e3, "limit_force": 2.0, "exponent": -0.4, "ratio": 0.0}
BOLT = ValanisJoint(
    name="bolt", direction=ROW, tangential_stiffness=1e3, slip_stiffness=200.0, limit_force=2.0, kappa=0.8
)
JOINTS = [CHAIN, BOLT, *(IwanJoint(name=f"lap {number}", **IWAN) for number in range(2))]
GROUPS = {"chain": ("chain",), "bolt": ("bolt",), "lap": ("lap 0", "lap 1")}
WITH_JOINTS = replace(MODEL.with_system(joints=[*MODEL.system.joints, *JOINTS]), joint_groups=GROUPS)


def test_the_friction_of_one_line() -> None:
    changed = make_scoped_parameter(MODEL, "left.friction_coefficient", 0.1).apply(MODEL, [1.3])
    for line, factor in (("left", 1.3), ("right", 1.0)):
        for now, before in zip(find_contacts(changed, line), find_contacts(MODEL, line), strict=True):
            assert now.friction_coefficient == pytest.approx(factor * before.friction_coefficient)
            assert now.tangential_stiffness == before.tangential_stiffness


def test_a_list_of_a_joint_and_joints_at_all_nodes_of_a_place() -> None:
    changed = make_scoped_parameter(WITH_JOINTS, "chain.limit_force", 0.1).apply(WITH_JOINTS, [2.0])
    (chain,) = find_joints(changed, "chain")
    assert chain.with_values({}).parameter_values[:4] == (1e3, 2e3, 2.0, 6.0)
    changed = make_scoped_parameter(WITH_JOINTS, "lap.limit_force", 0.1).apply(WITH_JOINTS, [0.5])
    assert [dict(zip(item.parameter_names, item.parameter_values, strict=True))["limit_force"]
            for item in find_joints(changed, "lap")] == [1.0, 1.0]  # fmt: skip


def test_density_and_modulus_of_one_part() -> None:
    system = MODEL.system
    parts = tuple(StructurePart(name=name, mass=share * system.mass, stiffness=share * system.stiffness)
                  for name, share in (("one", 0.25), ("two", 0.75)))  # fmt: skip
    model = replace(MODEL, parts=parts)
    heavier = make_scoped_parameter(model, "one.density", 0.01).apply(model, [1.04])
    np.testing.assert_allclose(heavier.system.mass, 1.01 * system.mass)
    stiffer = make_scoped_parameter(model, "two.E", 0.01).apply(model, [1.04])
    np.testing.assert_allclose(stiffer.system.stiffness, 1.03 * system.stiffness)


@pytest.mark.parametrize(
    ("name", "lower", "upper"),
    [("lap.exponent", 0.1, 0.99 / 0.4), ("bolt.slip_stiffness", 0.1, 1e3 / 200), ("bolt.kappa", 0.1, 1 / 0.8)],
)
def test_a_factor_stays_within_the_bounds_of_the_law(name: str, lower: float, upper: float) -> None:
    (factor,) = make_scoped_parameter(WITH_JOINTS, name, 10.0).parameters
    assert [factor.lower, factor.upper] == pytest.approx([lower, upper], rel=1e-5)


@pytest.mark.parametrize("kappa", [1 - 1e-15, 1 - 4e-7])
def test_a_number_at_an_end_of_its_law_is_calibrated_away_from_it(kappa: float) -> None:
    model = WITH_JOINTS.with_joints({"bolt": {"kappa": kappa}})
    (factor,) = make_scoped_parameter(model, "bolt.kappa", 0.1).parameters
    assert (factor.upper, factor.typical) == (pytest.approx(1.0, abs=1e-6), 0.9)


@pytest.mark.parametrize(
    ("name", "words"),
    [("lap.ratio", "is zero"), ("left.preload", "give one of"), ("middle.E", "no line, joint or part")],
)
def test_what_has_no_factor_is_refused(name: str, words: str) -> None:
    with pytest.raises(EffectError, match=words):
        make_scoped_parameter(WITH_JOINTS, name, 0.1)
