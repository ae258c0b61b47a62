"""Repeated virtual tests: what a loading history leaves behind, and what a laboratory would hand over."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from reduction.jointed_system import FrictionContact, JenkinsElement, JointedSystem
from transient.equilibrium import equilibrium, find_quasi_static_state
from transient.errors import TransientError
from transient.virtual_bench.campaign import CampaignLayout, CampaignPoints, write_campaign
from transient.virtual_bench.repeats import random_history, repeated_tests, sweep_settled
from transient.virtual_bench.sweep import VirtualSweepTest

K, KT, LIMIT, LOAD = 2e4, 5e4, 3.0, 10.0


def loaded_mass() -> JointedSystem:
    """A mass on a spring that rubs, pulled by a static load."""
    return JointedSystem(
        mass=[[1.0]],
        damping=[[5.0]],
        stiffness=[[K]],
        joints=[JenkinsElement(name="rub", direction=[1.0], tangential_stiffness=KT, limit_force=LIMIT)],
        static_load=np.array([LOAD]),
        harmonic_force=[[0], [1.0]],
    )


def pad() -> JointedSystem:
    """A mass pressed by its own weight on a pad that yields, on a spring."""
    contact = FrictionContact(
        name="pad 1", tangents=[1.0, 0.0], normal=[0.0, 1.0], normal_stiffness=1e6, tangential_stiffness=3e5,
        friction_coefficient=0.5,
    )  # fmt: skip
    return JointedSystem(
        mass=np.diag([1.0, 1.0]),
        damping=np.diag([40.0, 40.0]),
        stiffness=np.diag([1e6, 1e5]),
        joints=[contact],
        static_load=np.array([0.0, 20.0]),
        harmonic_force=np.array([[0, 0], [1.0, 0]]),
    )


def test_an_overshoot_of_the_load_leaves_its_friction_force_behind() -> None:
    system, over = loaded_mass(), 1.5
    state = find_quasi_static_state(system, (over, 1.0))
    # At the peak friction is at its limit; on the way back it sticks until it pushes the other way.
    peak = (over * LOAD - LIMIT) / K
    slider = peak - LIMIT / KT
    expected = (LOAD + KT * slider) / (K + KT)
    assert abs(KT * (expected - slider)) < LIMIT
    # Newton's method stops at round-off of the positions.
    assert state.displacement[0] == pytest.approx(expected, rel=1e-9)
    assert state.slider[0] == pytest.approx(slider, rel=1e-9)
    straight = find_quasi_static_state(system, (1.0,))
    np.testing.assert_allclose(straight.displacement, equilibrium(system).displacement, rtol=1e-9)
    # The rest that was left is where the next ramp begins.
    assert find_quasi_static_state(system, (1.0,), state.slider).displacement == pytest.approx(
        state.displacement, rel=1e-9
    )
    assert find_quasi_static_state(system, (over, 1.0), straight.slider).slider == pytest.approx(state.slider, rel=1e-9)


def test_a_load_that_nothing_bears_has_no_rest_on_its_way() -> None:
    loose = JointedSystem(mass=[[1.0]], damping=[[0.0]], stiffness=[[0.0]], joints=[], static_load=np.array([1.0]))
    with pytest.raises(TransientError, match="not supported"):
        find_quasi_static_state(loose, (1.0,))


def test_histories_begin_with_the_whole_load_and_end_with_it() -> None:
    random = np.random.default_rng(0)
    histories = [random_history(random, first=number == 0) for number in range(200)]
    assert histories[0].loads[-1] == 1.0
    assert all(item.loads == () or item.loads[-1] == 1.0 for item in histories)
    assert any(not item.loads for item in histories)
    assert {item.overshoot > 1 for item in histories} == {True, False}


def test_repeats_of_a_stuck_mass_agree_but_for_the_force_that_their_history_left(tmp_path: Path) -> None:
    frequencies, level = [150.0, 170.0, 190.0], 0.2
    tests = [
        list(repeated_tests(pad(), {"mass": np.array([1.0, 0.0])}, frequencies, [level], n_repeat=3, seed=seed))
        for seed in (4, 4)
    ]
    static = []
    for one, other in zip(*tests, strict=True):
        np.testing.assert_array_equal(one.readings.motion, other.readings.motion)
        assert one.readings.periodic.all()
        omega = 2 * np.pi * np.array([*frequencies, *frequencies[::-1]])
        exact = level / np.abs(1.3e6 - omega**2 + 40j * omega)
        # What is left of the transient, 1e-4, and the error of 256 steps.
        np.testing.assert_allclose(np.abs(one.readings.motion[:, 0, 0]), exact, rtol=3e-4)
        static.append(one.readings.force[0, 0, 0].real)
    assert np.ptp(static) > 1.0
    points = CampaignPoints(levels=[level], frequencies=frequencies, free_frequencies=(), n_repeat=3)
    write_campaign(
        tmp_path, tests[0], points, CampaignLayout(title="Pad", sensors=["mass"], lines=["pad"], direction="x")
    )
    assert {file.name for file in tmp_path.iterdir()} == {"campaign.toml", "stepped.csv"}
    campaign = read_campaign(tmp_path)
    assert [item.name for item in campaign.tests] == ["stepped"]
    table = campaign.measurement
    first = (table.sensor == 0) & (table.harmonic == 1) & (table.repeat == 1) & (table.sweep == 1)
    np.testing.assert_allclose(table.value[first], tests[0][0].readings.motion[:3, 0, 0], rtol=1e-9)


def test_the_search_from_a_state_finds_the_steady_state_that_waiting_finds() -> None:
    bench = VirtualSweepTest(pad(), {"pad": np.array([1.0, 0.0])})
    left = find_quasi_static_state(bench.structure, (1.4, 1.0), bench.random_start(np.array([0.6])).slider)
    frequencies, level = [150.0, 170.0], 0.2  # so small that nothing slips
    waited = sweep_settled(bench, frequencies, level, left, 1e-6)
    searched = bench.sweep(frequencies, level, start=left, tolerance=1e-6)
    # Both stop within a millionth of the motion of the same periodic motion.
    np.testing.assert_allclose(searched.motion, waited.motion, rtol=1e-4, atol=1e-4 * np.abs(waited.motion).max())
    np.testing.assert_allclose(searched.force[:, :, 0], waited.force[:, :, 0], rtol=1e-3, atol=1e-3)
    # The state matters: the rest alone leaves other static forces.
    other = bench.sweep(frequencies, level, tolerance=1e-6)
    assert np.abs(searched.force[:, 0, 0] - other.force[:, 0, 0]).max() > 1e-2
