"""Calibration parameters scale what all contacts, the damping or all parts have in common."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from correlation.model import Model
from diagnosis.candidate.effect import EffectError
from diagnosis.fit.calibration_parameter import CalibrationParameter, list_calibration_parameters, make_factor
from diagnosis.fit.fit_parameter import Unknowns
from hbsolve.errors import ModelError
from reduction.joint_law.friction_contact import list_friction_contacts
from reduction.jointed_system import FrictionContact

FIELD = {"kt": "tangential_stiffness", "kn": "normal_stiffness", "mu": "friction_coefficient"}


def of(model: Model, name: str) -> CalibrationParameter:
    return next(item for item in list_calibration_parameters(model) if item.name == name)


@pytest.mark.parametrize("name", ["kt", "kn", "mu"])
def test_contact_factors_scale_one_property_of_every_contact_and_nothing_else(bench: Model, name: str) -> None:
    changed = of(bench, name).apply(bench, [1.3])
    for before, after in zip(bench.system.joints, changed.system.joints, strict=True):
        assert isinstance(before, FrictionContact)
        wanted = replace(before, **{FIELD[name]: 1.3 * getattr(before, FIELD[name])})
        for key, value in vars(wanted).items():
            np.testing.assert_array_equal(getattr(after, key), value)
    for matrix in ("mass", "damping", "stiffness", "static_load"):
        np.testing.assert_array_equal(getattr(changed.system, matrix), getattr(bench.system, matrix))


def test_zeta_scales_the_damping_and_e_the_stiffness_of_the_parts(bench: Model) -> None:
    np.testing.assert_allclose(of(bench, "zeta").apply(bench, [1.3]).system.damping, 1.3 * bench.system.damping)
    # What is no part, such as a spring that was added, keeps its stiffness.
    sprung = bench.with_system(stiffness=bench.system.stiffness + 50 * np.eye(7))
    stiffer = of(sprung, "E").apply(sprung, [1.02]).system
    np.testing.assert_allclose(stiffer.stiffness, 1.02 * bench.system.stiffness + 50 * np.eye(7), rtol=1e-14)
    # The damping of the bench is not in proportion to a stiffness with such a spring, so it stays.
    np.testing.assert_array_equal(stiffer.damping, bench.system.damping)


def test_a_factor_of_one_changes_nothing(bench: Model) -> None:
    for item in list_calibration_parameters(bench):
        assert (item.parameters[0].vanishes, item.parameters[0].unit) == (1.0, "-")
        same = item.apply(bench, [1.0]).system
        for matrix in ("mass", "damping", "stiffness", "static_load"):
            np.testing.assert_array_equal(getattr(same, matrix), getattr(bench.system, matrix))
        for before, after in zip(bench.system.joints, same.joints, strict=True):
            assert [v for v in vars(before).values() if isinstance(v, float)] == [
                v for v in vars(after).values() if isinstance(v, float)
            ]


def test_priors_are_relative_and_can_be_overridden(bench: Model) -> None:
    assert {item.name: item.deviation for item in list_calibration_parameters(bench)} == {
        "kt": 0.1, "kn": 0.1, "mu": 0.1, "zeta": 0.2, "E": 0.01
    }  # fmt: skip
    given = {item.name: item for item in list_calibration_parameters(bench, deviation={"kt": 0.3, "E": 0.0})}
    assert list(given) == ["kt", "kn", "mu", "zeta"]
    assert (given["kt"].deviation, given["kt"].parameters[0].typical) == (0.3, 1.3)


def test_what_a_model_has_not_is_not_calibrated(bench: Model) -> None:
    assert [item.name for item in list_calibration_parameters(bench.without_contacts())] == ["zeta", "E"]
    smooth = bench.with_joints({joint.name: {"friction_coefficient": 0.0} for joint in bench.system.joints})
    assert [item.name for item in list_calibration_parameters(smooth)] == ["kt", "kn", "zeta", "E"]
    assert [item.name for item in list_calibration_parameters(bench.with_system(damping=np.zeros((7, 7))))] == [
        "kt",
        "kn",
        "mu",
        "E",
    ]


def test_accepted_parameters_act_before_or_after_the_contacts_are_taken_away(bench: Model) -> None:
    for item in list_calibration_parameters(bench):
        one, other = (
            item.apply(bench, [1.1]).without_contacts().system,
            item.apply(bench.without_contacts(), [1.1]).system,
        )
        np.testing.assert_array_equal(one.stiffness, other.stiffness)
        np.testing.assert_array_equal(one.damping, other.damping)
        assert len(one.joints) == len(other.joints) == 0


def test_accepted_parameters_travel(bench: Model) -> None:
    for item in list_calibration_parameters(bench):
        assert pickle.loads(pickle.dumps(item)).parameters == item.parameters


def test_values_that_make_no_friction_are_no_model(bench: Model) -> None:
    """Each within its own bounds; a fit turns back where there is no model."""
    mu = of(bench, "mu")
    unknowns = Unknowns(base=bench, effects=(mu, mu), prior=np.ones(2))
    largest = max(joint.friction_coefficient for joint in list_friction_contacts(bench.system.joints))
    just = (0.999 * 10 / largest) ** 0.5
    assert unknowns.compose(np.array([just, just])).system.n_dof == bench.system.n_dof
    with pytest.raises(ModelError, match=r"mu: .* beyond that of any two solids"):
        unknowns.compose(np.array([1.01 * just, 1.01 * just]))


def test_bad_priors_are_refused_in_words(bench: Model) -> None:
    with pytest.raises(EffectError, match='"nu" is not a calibration parameter: there are kt, kn, mu, zeta, E'):
        list_calibration_parameters(bench, deviation={"nu": 0.1})
    with pytest.raises(EffectError, match=r"the deviation of kt is -0\.1: give a relative standard deviation"):
        list_calibration_parameters(bench, deviation={"kt": -0.1})


@pytest.mark.parametrize("reach", [0.0, 4e-7])
def test_a_factor_that_can_only_be_one_is_refused_in_words(reach: float) -> None:
    with pytest.raises(EffectError, match=r'a factor on "bolt\.kappa" may only be .* do not calibrate it'):
        make_factor("bolt.kappa", 1 - reach, 1 + reach, 0.1)
