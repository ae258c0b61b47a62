"""What limits must obey, whatever the system."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.energy import energy_balance
from hbsolve.errors import BalanceError
from hbsolve.limits.local_search import LimitSide
from hbsolve.limits.loss_factor import LossFactor, loss_factor_limits
from hbsolve.limits.objective import ContactForceHarmonic, OutputHarmonic
from hbsolve.limits.random_histories import independent_histories
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.result import ResponseLimits, load_limits
from hbsolve.limits.search import LimitSettings
from reduction.jointed_system import FrictionContact, JointedSystem
from tests.slow import slow

OMEGA = 2 * np.pi * 284.0 * np.linspace(0.95, 1.0, 6)
#: Those of a whole curve.
CURVE = OMEGA[1:5]
LEVELS = [0.1, 0.4]
QUICK = LimitSettings(sample=24, block=3)
#: Without frequencies beside those asked for.
ALONE = replace(QUICK, frequencies=1)


@pytest.fixture(scope="module")
def balance(wedge: JointedSystem) -> HarmonicBalance:
    return HarmonicBalance(system=wedge, n_harmonic=4, n_sample=64)


@pytest.fixture(scope="module")
def limits(balance: HarmonicBalance) -> ResponseLimits:
    return response_limits(limit_problem(balance, OutputHarmonic(row=0)), CURVE, LEVELS, settings=QUICK)


def same(one: ResponseLimits, other: ResponseLimits) -> None:
    for item in fields(ResponseLimits):
        np.testing.assert_array_equal(getattr(one, item.name), getattr(other, item.name), err_msg=item.name)


def test_every_limit_is_a_steady_state_in_the_box(balance: HarmonicBalance, limits: ResponseLimits) -> None:
    assert (limits.residual_norm <= 1e-9).all()
    assert (np.abs(limits.initial_slider - limits.nominal) <= limits.reach[:, None] * (1 + 1e-12)).all()
    assert (np.abs(limits.multiplier) <= 1).all()
    for side in LimitSide:
        state = limits.state(balance, side, 1, 3)
        row = list(LimitSide).index(side)
        # Solved again from its motion, to Newton's tolerance.
        assert state.amplitude(0) == pytest.approx(limits.value[row, 1, 3], rel=1e-7)


def test_histories_that_had_no_part_in_the_search_stay_inside(balance: HarmonicBalance, limits: ResponseLimits) -> None:
    fresh = independent_histories(limit_problem(balance, OutputHarmonic(row=0)), limits, 60, seed=9)
    assert np.isfinite(fresh.value).mean() > 0.95
    assert fresh.share_outside(1e-3) == 0.0
    # They fill a good part of the band where there is one, so they would see limits that are too narrow.
    assert np.nanmax(fresh.value[1], axis=1).max() > 0.7 * limits.upper[1].max()


@slow
def test_a_larger_box_is_never_narrower(balance: HarmonicBalance) -> None:
    upper, lower = [], []
    for reach in (1e-6, 3e-6, 1e-5):
        result = response_limits(
            limit_problem(balance, OutputHarmonic(row=0), reach=reach), OMEGA[:3], [0.4], settings=QUICK
        )
        upper.append(result.upper[0])
        lower.append(result.lower[0])
    # Searches end where a step gains less than 1e-4.
    assert (np.diff(upper, axis=0) >= -1e-3 * np.array(upper[:-1])).all()
    assert (np.diff(lower, axis=0) <= 1e-3 * np.array(lower[:-1])).all()
    assert (upper[-1] > upper[0]).any()


def test_certified_steps_gain_next_to_nothing(limits: ResponseLimits) -> None:
    # A vertex that the linear programme can still improve would have been improved by the search: 1e-4 and a tenth.
    assert (limits.realised <= 1e-3).all()
    assert (limits.starts >= 1).all()
    assert (limits.n_undetermined <= 4).all()


def test_stopped_search_goes_on_where_it_stopped(balance: HarmonicBalance, limits: ResponseLimits) -> None:
    problem, store = limit_problem(balance, OutputHarmonic(row=0)), {}
    calls: list[str] = []

    class Stopped(RuntimeError):
        pass

    class Store(dict[str, Any]):
        def __setitem__(self, key: str, value: Any) -> None:
            calls.append(key)
            super().__setitem__(key, value)
            if len(calls) == 9:
                raise Stopped

    store = Store()
    with pytest.raises(Stopped):
        response_limits(problem, CURVE, LEVELS, settings=QUICK, store=store)
    result = response_limits(problem, CURVE, LEVELS, settings=QUICK, store=store)
    same(result, limits)
    # No task was run twice.
    assert len(calls) == len(set(calls)) == len(store)


@slow
def test_processes_find_the_same_limits(balance: HarmonicBalance, limits: ResponseLimits) -> None:
    stages = []
    with ProcessPoolExecutor(1) as executor:
        result = response_limits(
            limit_problem(balance, OutputHarmonic(row=0)), CURVE, LEVELS, settings=QUICK, executor=executor,
            progress=stages.append,
        )  # fmt: skip
    same(result, limits)
    assert {item.stage for item in stages} >= {
        "population",
        "neighbours",
        "levels",
        "perturbations",
        "audit",
        "certificates",
    }
    assert all(item.done <= item.total for item in stages)


def test_saved_limits_come_back(limits: ResponseLimits, tmp_path: Path) -> None:
    limits.save(tmp_path / "limits.nc")
    same(load_limits(tmp_path / "limits.nc"), limits)
    with pytest.raises(BalanceError, match="contains no limits"):
        load_limits(tmp_path / "other.nc")


@pytest.mark.parametrize(
    ("direction", "harmonic"), [(0, 1), (-1, 0), pytest.param(0, 0, marks=slow), pytest.param(-1, 1, marks=slow)]
)
def test_limits_of_a_line_force_are_reached_by_its_state(
    balance: HarmonicBalance, direction: int, harmonic: int
) -> None:
    names = ["blade 1", "blade 2"]
    force = ContactForceHarmonic(joints=names, direction=direction, harmonic=harmonic)
    result = response_limits(limit_problem(balance, force), OMEGA[4:5], [0.4], settings=ALONE)
    assert (result.lower <= result.upper).all()
    for row, side in enumerate(LimitSide):
        motions = contact_motion(balance.at_level(0.4), result.state(balance, side, 0, 0))
        total = sum(motion.force[direction] for motion in motions if motion.name in names)
        wave = np.fft.rfft(total) / len(total)
        value = wave[0].real if harmonic == 0 else 2 * abs(wave[harmonic])
        assert value == pytest.approx(result.value[row, 0, 0], rel=1e-6, abs=1e-6)


@slow
def test_a_gap_field_that_a_rigid_motion_of_the_damper_absorbs_changes_no_limit(wedge: JointedSystem) -> None:
    # The damper alone: shifted and turned by micrometres, which opens each contact by a gap of its own.
    motion = np.array([0.0, 2e-6, -3e-6, 4e-7])
    gaps = [replace(item, gap=float(item.normal @ motion)) for item in wedge.joints]
    assert np.ptp([item.gap for item in gaps]) > 5e-6
    # Its soft wires pull it back by what they are stretched; without them it were free.
    shifted = JointedSystem(
        mass=wedge.mass,
        damping=wedge.damping,
        stiffness=wedge.stiffness,
        joints=gaps,
        static_load=wedge.static + wedge.stiffness @ motion,
        harmonic_force=wedge.dynamic,
    )
    result = []
    for system, nominal in ((wedge, np.zeros(4)), (shifted, np.array([item.tangents[0] @ motion for item in gaps]))):
        balance = HarmonicBalance(system=system, n_harmonic=4, n_sample=64)
        problem = limit_problem(balance, OutputHarmonic(row=0), nominal=nominal)
        result.append(response_limits(problem, OMEGA[2:5], [0.4], settings=QUICK))
    # Both searches make the same steps, up to round-off that Newton's tolerance of 1e-9 bounds and kinks enlarge.
    np.testing.assert_allclose(result[1].value, result[0].value, rtol=1e-3)
    assert result[1].reach == pytest.approx(result[0].reach, rel=1e-6)


def test_the_loss_factor_is_that_of_the_energies(balance: HarmonicBalance) -> None:
    problem = limit_problem(balance, LossFactor())
    result = response_limits(problem, OMEGA[2:4], [0.4], settings=ALONE)
    for row, side in enumerate(LimitSide):
        state = result.state(balance, side, 0, 1)
        eta = energy_balance(balance.at_level(0.4), state).loss_factor
        # The springs' energy counts here in the harmonics that are kept.
        assert eta == pytest.approx(result.value[row, 0, 1], rel=0.02)


@slow
def test_the_papers_limits_lie_within_those_of_the_amplitude(balance: HarmonicBalance) -> None:
    output = OutputHarmonic(row=0)
    reach = limit_problem(balance, output).box.reach
    amplitude = response_limits(limit_problem(balance, output), CURVE, [0.4], settings=QUICK)
    paper = loss_factor_limits(balance, output, CURVE, [0.4], reach=reach, settings=QUICK)
    assert (paper.loss_factor.lower <= paper.loss_factor.upper).all()
    assert (paper.amplitude <= amplitude.upper * 1.002).all()
    assert (paper.amplitude >= amplitude.lower * 0.998).all()
    # And somewhere they do not reach them: the loss factor does not bound the amplitude.
    assert (paper.amplitude[1] < 0.95 * amplitude.upper).any()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"angular_frequency": [20.0, 10.0]}, "10 comes after 20"),
        ({"levels": [-1.0]}, "levels must be positive"),
        ({"levels": []}, "levels must be positive"),
    ],
)
def test_bad_curves_are_refused(balance: HarmonicBalance, change: dict[str, Any], says: str) -> None:
    problem = limit_problem(balance, OutputHarmonic(row=0))
    given = {"angular_frequency": [10.0], "levels": [1.0]} | change
    with pytest.raises(BalanceError, match=says):
        response_limits(problem, **given)


def test_a_pressed_contact_without_friction_gives_no_reach() -> None:
    tangent, normal = np.eye(2)
    smooth = FrictionContact(name="smooth", tangents=tangent, normal=normal, tangential_stiffness=1e4,
                             normal_stiffness=1e4, friction_coefficient=0.0, preload=10.0)  # fmt: skip
    system = JointedSystem(mass=np.eye(2), damping=2 * np.eye(2), stiffness=1e4 * np.eye(2), joints=[smooth],
                           static_load=[0.0, 10.0], harmonic_force=[[0, 0], [1.0, 0]])  # fmt: skip
    with pytest.raises(BalanceError, match=r"reach = 0 m must be positive.*friction limit"):
        limit_problem(HarmonicBalance(system=system, n_harmonic=3), OutputHarmonic(row=0))


def test_bad_problems_are_refused(balance: HarmonicBalance) -> None:
    with pytest.raises(BalanceError, match="degree of freedom 4 does not exist"):
        limit_problem(balance, OutputHarmonic(row=4))
    with pytest.raises(BalanceError, match="harmonic 4 is not between 0 and 3"):
        limit_problem(balance, OutputHarmonic(row=0, harmonic=4))
    with pytest.raises(BalanceError, match='"pad" is not a friction contact'):
        limit_problem(balance, ContactForceHarmonic(joints=["pad"], direction=0))
    with pytest.raises(BalanceError, match="no direction 1"):
        limit_problem(balance, ContactForceHarmonic(joints=["blade 1"], direction=1))
    with pytest.raises(BalanceError, match="reach = -1 m must be positive"):
        limit_problem(balance, OutputHarmonic(row=0), reach=-1.0)
    with pytest.raises(BalanceError, match="population = 0 must be at least 1"):
        LimitSettings(population=0)
