"""Joints that belong to no contact line: they stay in the free configuration, and their friction damps as well."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.model import Model, Sensor
from reduction.joint_law.jenkins import JenkinsElement
from reduction.jointed_system import JointedSystem
from study.compare.sentence import judge
from study.compare.suspicions import find_all_suspicions
from study.estimate.resonance import LINEAR, SLIPS, STEADY, MeasuredResonance, estimate_damping

MASS, STIFFNESS, RATIO = 1.0, (2 * np.pi * 100) ** 2, 0.005


def model(*joints: JenkinsElement) -> Model:
    damping = 2 * RATIO * np.sqrt(STIFFNESS * MASS)
    system = JointedSystem(
        mass=[[MASS]], damping=[[damping]], stiffness=[[STIFFNESS]], joints=joints, harmonic_force=[[0.0], [1.0]]
    )
    return Model(system=system, sensors=(Sensor(name="tip", row=np.ones(1)),), places={"tip": np.ones(1)})


def slider() -> JenkinsElement:
    return JenkinsElement(name="rub", direction=np.ones(1), tangential_stiffness=0.01 * STIFFNESS, limit_force=1.0)


def resonance(*, free: bool = False, is_steady: bool = False) -> MeasuredResonance:
    return MeasuredResonance(
        free=free, frequency=100.0, frequency_deviation=0.01, damping=0.02, damping_deviation=1e-4, source="a sweep",
        is_steady=is_steady,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("joints", "free", "is_steady", "bias"),
    [((slider(),), False, False, SLIPS), ((slider(),), True, False, SLIPS), ((slider(),), False, True, STEADY),
     ((), False, False, LINEAR)],
)  # fmt: skip
def test_the_damping_of_a_structure_with_a_slider_is_an_upper_bound(
    joints: tuple[JenkinsElement, ...], free: bool, is_steady: bool, bias: str
) -> None:
    (zeta,) = estimate_damping(model(*joints), resonance(free=free, is_steady=is_steady))
    assert zeta.bias == (bias,)
    assert (zeta.interval[0] == 0.0) == zeta.is_upper_bound == (bias == SLIPS)


def campaign(configuration: str) -> Campaign:
    frequency = np.linspace(95.0, 105.0, 11)
    omega, one = 2 * np.pi * frequency, np.ones(11)
    value = 1 / (STIFFNESS - omega**2 + 2j * RATIO * np.sqrt(STIFFNESS) * omega)
    table = Measurement(
        test=0 * one, order=np.arange(11), repeat=one, sweep=one, level=one, frequency=frequency, sensor=0 * one,
        harmonic=one, value=value,
    )  # fmt: skip
    sensor = MeasuredSensor(name="tip", quantity="displacement", direction="x", place="tip")
    test = Test(name="hammer", configuration=configuration)
    return Campaign(
        title="one mass", folder=Path(), sensors=(sensor,), tests=(test,), measurement=table, held_out=HeldOut()
    )


def test_a_free_test_beside_a_joint_that_stays_is_remarked() -> None:
    said = [str(item) for item in find_all_suspicions(campaign("free"), model(slider())) if '"hammer"' in item.where]
    assert len(said) == 1
    assert "rub" in said[0]
    for clean in (
        find_all_suspicions(campaign("free"), model()),
        find_all_suspicions(campaign("jointed"), model(slider())),
    ):
        assert not any('"hammer"' in item.where for item in clean)


def test_a_headline_says_which_joints_are_kept_in_a_free_structure() -> None:
    kept = find_all_suspicions(campaign("free"), model(slider()))
    for difference in (0.5, 5.0):
        tone, tag = judge(difference, (), kept)
        assert tag.endswith("; it keeps rub in the free structure (hammer)")
        # It is how the model was made, and no doubt about the measurements.
        assert tone == judge(difference, ())[0]
    assert judge(5.0, (), find_all_suspicions(campaign("free"), model())) == judge(5.0, ())
