"""Friction coefficient and preload from the measured forces of a line."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import CONTACT_FORCE, Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.model import Model, Sensor
from reduction.jointed_system import FrictionContact, JointedSystem
from study.estimate.contact_force import compute_largest_certain_ratio, count_harmonics, estimate_from_forces


def model() -> Model:
    contact = FrictionContact(
        name="seam.1", normal=np.array([0.0, 1.0]), tangents=np.array([[1.0, 0.0]]), normal_stiffness=1e6,
        tangential_stiffness=1e6, friction_coefficient=0.5, preload=25.0,
    )  # fmt: skip
    system = JointedSystem(mass=np.eye(2), damping=np.eye(2), stiffness=1e6 * np.eye(2), joints=[contact])
    return Model(
        system=system, sensors=(Sensor(name="a", row=np.array([1.0, 0.0])),), lines={"seam": ("seam.1",)}, n_harmonic=4
    )


def campaign(tangential: dict[int, complex], normal: dict[int, complex], levels: tuple[float, ...]) -> Campaign:
    """Both forces in three repeats; they grow with the level, but for the static part of N."""
    rows = [
        (level, repeat, sensor, k, value * (1 if k == 0 else level))
        for level in levels
        for repeat in range(3)
        for sensor, values in enumerate((tangential, normal))
        for k, value in values.items()
    ]
    level, repeat, sensor, harmonic, value = (np.array(column) for column in zip(*rows, strict=True))
    zeros = np.zeros(len(rows), dtype=int)
    table = Measurement(
        test=zeros, order=zeros, repeat=repeat, sweep=zeros, level=level, frequency=np.full(len(rows), 100.0),
        sensor=sensor, harmonic=harmonic, value=value,
    )  # fmt: skip
    sensors = tuple(
        MeasuredSensor(name=name, quantity=CONTACT_FORCE, line="seam", component=name)
        for name in ("tangential", "normal")
    )
    return Campaign(
        title="", folder=Path(), sensors=sensors, tests=(Test(name="jointed"),), measurement=table, held_out=HeldOut()
    )


def test_the_largest_ratio_over_the_period_is_a_lower_bound_of_friction() -> None:

    data = campaign({0: 1.0, 1: 2.0}, {0: 20.0, 1: -1.5}, (1.0, 5.0))
    friction, preload = estimate_from_forces(model(), data)
    phase = np.linspace(0, 2 * np.pi, 10001)
    truth = np.abs((1 + 10 * np.cos(phase)) / (20 - 7.5 * np.cos(phase))).max()
    assert friction.parameter == "mu"
    assert friction.value == pytest.approx(truth, rel=1e-3)  # 256 instants: (2 pi / 256)^2 / 8
    assert friction.interval[1] == np.inf
    assert friction.interval[0] < truth
    assert "5 N" in friction.source
    assert any("lower bound" in sentence for sentence in friction.bias)
    assert preload.value == pytest.approx(20.0)
    assert preload.model_value == 25.0


@pytest.mark.parametrize("n", [1, 2, 3, 5, 7])
def test_a_few_harmonics_of_gross_slip_claim_no_more_friction_than_there_is(n: int) -> None:
    # T = mu N sign(sin): the sum of a few of its harmonics overshoots; N varies with the motion.
    mu, phase = 0.3, 2 * np.pi * (np.arange(4096) + 0.5) / 4096
    pressed = 20 + 8 * np.cos(phase + 0.4) + 5 * np.cos(3 * phase)
    forces = (mu * pressed * np.sign(np.sin(phase)), pressed)
    tangential, normal = (
        {k: complex(np.mean(force * np.exp(-1j * k * phase)) * (1 if k == 0 else 2)) for k in range(n + 1)}
        for force in forces
    )
    certain = compute_largest_certain_ratio(tangential, normal, n)
    assert 0.4 * mu < certain <= mu
    raw = next(iter(estimate_from_forces(model(), campaign(tangential, normal, (1.0,)))))
    assert raw.value > mu
    # The scatter of three per cent of load cells.
    assert raw.interval[0] == pytest.approx(certain * (1 - 1.96 * 0.03), rel=1e-9)


def test_harmonics_count_up_to_the_first_that_one_force_lacks() -> None:
    assert count_harmonics({0: 1, 1: 1, 2: 1, 3: 1}, {0: 1, 1: 1, 3: 1}) == 1


def test_lift_off_does_not_make_the_ratio_infinite() -> None:
    data = campaign({0: 0.0, 1: 2.0}, {0: 20.0, 1: -20.0j}, (1.0,))
    friction = next(iter(estimate_from_forces(model(), data)))
    assert friction.value < 2.0 / (0.1 * 40.0) + 1e-9  # no less normal force than a tenth of the largest counts
