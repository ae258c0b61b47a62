"""Branches against exact solutions, against single solutions, and against the equation of motion in plain matrices."""

import pickle
import re
from dataclasses import dataclass, replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ellipk

from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.contact_motion import contact_motion
from hbsolve.continuation.branch import load_branch
from hbsolve.continuation.continuation_parameter import FrequencyPath, LevelPath
from hbsolve.continuation.response import begin, follow_to_end, frequency_response, joint_response, level_response, run
from hbsolve.continuation.step import Continuation
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.errors import BalanceError
from hbsolve.forced_response import HarmonicForce, forced_response
from hbsolve.fourier import samples_from_coefficients
from hbsolve.state import SteadyState
from hbsolve.steady_state import steady_state
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    JointedSystem,
    QuadraticDamper,
    along,
    between,
)
from tests.slow import slow


def duffing(level: float = 1.0, zeta: float = 5e-3, n_harmonic: int = 10) -> HarmonicBalance:
    """q'' + 2 zeta q' + q + q^3 = 0.01 level cos."""
    system = JointedSystem(
        mass=[[1.0]],
        damping=[[2 * zeta]],
        stiffness=[[1.0]],
        joints=[CubicSpring(name="cubic", direction=np.ones(1), stiffness=1.0)],
        harmonic_force=[[0.0], [0.01]],
    )
    return HarmonicBalance(system=system, n_harmonic=n_harmonic, level=level)


def chain(damping: str, joints: bool = True) -> JointedSystem:
    """Five masses, all laws; loads in the mean and in two harmonics."""
    n = 5
    stiffness = 100 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    both = np.vstack([along(n, {2: 1.0}), along(n, {3: 0.8, 4: 0.6})])
    laws: list[Joint] = [
        FrictionContact(
            name="rub",
            normal=between(n, 1, 0),
            tangents=along(n, {2: 1.0}),
            normal_stiffness=60.0,
            tangential_stiffness=50.0,
            friction_coefficient=0.3,
            preload=1.0,
        ),
        FrictionContact(
            name="pad",
            normal=along(n, {1: -1.0}),
            tangents=both,
            normal_stiffness=40.0,
            tangential_stiffness=30.0,
            friction_coefficient=0.4,
            preload=0.8,
            friction=Friction.COULOMB,
        ),
        JenkinsElement(name="slider", direction=between(n, 4, 3), tangential_stiffness=30.0, limit_force=0.4),
        CubicSpring(name="cubic", direction=along(n, {0: 1.0}), stiffness=200.0),
        ElasticStop(name="stop", direction=along(n, {4: 1.0}), stiffness=80.0, gap=0.02),
        QuadraticDamper(name="drag", direction=along(n, {2: 1.0}), damping=0.5),
    ]
    D = sum(j.tangential_stiffness * j.tangents.T @ j.tangents for j in laws if isinstance(j, FrictionContact))
    mass = np.diag([1.0, 1.5, 1.0, 0.8, 1.2]) if damping != "modal" else np.eye(n)
    matrices = {
        "of the free structure": 1e-3 * stiffness + 0.2 * mass,
        "modal": 0.4 * np.eye(n),
        "coupled": np.diag([0.1, 0.9, 0.2, 0.5, 0.3]) + 1e-4 * np.asarray(D),
    }
    force = np.zeros((3, n), dtype=complex)
    force[1, 4], force[2, 1] = 3.0 - 1.0j, 0.5j
    return JointedSystem(
        mass=mass,
        damping=matrices[damping],
        stiffness=stiffness,
        joints=laws if joints else (),
        static_load=[0.3, 0.0, 0.0, 0.0, 0.0],
        harmonic_force=force,
    )


def folds(values: NDArray[np.float64]) -> list[int]:
    """Points where a branch turns round."""
    return [int(k) + 1 for k in np.flatnonzero(np.diff(np.sign(np.diff(values))))]


# ---- exact solutions


@pytest.mark.parametrize("level", [0.2, 1.0, 3.0])
def test_duffing_at_phase_resonance_has_the_period_of_its_free_vibration(level: float) -> None:
    balance = duffing(level)
    branch = frequency_response(balance, 0.8, 3.0, step=0.02)
    q = branch.output(0)
    lag = (q / abs(q)).real  # cosine of the phase, zero where the force and the damping cancel
    top = int(branch.amplitude(0).argmax())
    near = np.arange(top - 12, top + 12)
    cross = near[np.flatnonzero(np.diff(np.sign(lag[near])))[0]]
    four = slice(cross - 1, cross + 3)
    # A cubic through four points of the arc: the phase turns evenly along it.
    highest = samples_from_coefficients(branch.coefficients[four, :, 0].T, 4096).max(axis=0)
    omega, a = (np.polyval(np.polyfit(lag[four], item, 3), 0.0) for item in (branch.angular_frequency[four], highest))
    m = a**2 / (2 * (1 + a**2))
    free = np.pi * np.sqrt(1 + a**2) / (2 * ellipk(m))
    assert a > 0.15
    np.testing.assert_allclose(omega, free, rtol=1e-4)  # damping ratio 5e-3: terms of its square, 2.5e-5


def test_a_structure_whose_joints_are_never_touched_is_linear() -> None:
    system = chain("of the free structure", joints=False)
    apart = [
        replace(joint, preload=0.0, gap=10.0) for joint in chain("modal").joints if isinstance(joint, FrictionContact)
    ]
    stop = ElasticStop(name="stop", direction=along(5, {4: 1.0}), stiffness=80.0, gap=10.0)
    balance = HarmonicBalance(system=replace(system, joints=[*apart, stop]), n_harmonic=4)
    branch = frequency_response(balance, 3.0, 22.0)
    force = np.zeros((4, 5), dtype=complex)
    force[:3] = system.dynamic
    force[0] = system.static
    linear = forced_response(system, HarmonicForce(coefficients=force), branch.angular_frequency)
    scale = np.abs(linear.coefficients).max()
    np.testing.assert_allclose(branch.coefficients, linear.coefficients, atol=1e-8 * scale)  # residual 1e-9
    np.testing.assert_array_equal(branch.contact_share, np.broadcast_to([0, 0, 1], branch.contact_share.shape))


@pytest.mark.parametrize("damping", ["of the free structure", "modal", "coupled"])
def test_states_satisfy_the_equation_of_motion_in_plain_matrices(damping: str) -> None:
    system = chain(damping)
    balance = HarmonicBalance(system=system, n_harmonic=6)
    branch = frequency_response(balance, 4.0, 16.0, step=1.0)
    assert branch.stop_reason is StopReason.REACHED
    assert (branch.contact_share[:, 0, :2].max(axis=0) > 0.2).all()  # slips and sticks
    assert branch.contact_share[:, :, 2].max() > 0.1  # lifts off
    start: NDArray[np.float64] | None = None
    for point in range(0, len(branch.angular_frequency), 3):
        start = branch.start(balance, point)
        state = steady_state(balance, float(branch.angular_frequency[point]), start=start)
        assert left_over(balance, state) < 1e-7  # |R| < 1e-9 of the motion, and stiff against soft contacts


def left_over(balance: HarmonicBalance, state: SteadyState) -> float:
    """|M q'' + C q' + K q + B^T f - f_ext| over |f_ext|, without receptances."""
    system, q = balance.system, state.coefficients
    w = state.angular_frequency * np.arange(len(q))[:, None]
    left = q @ system.stiffness.T + 1j * w * (q @ system.damping.T) - w**2 * (q @ system.mass.T)
    for joint, motion in zip(system.joints, contact_motion(balance, state), strict=True):
        force = np.fft.rfft(motion.force.T, axis=0)[: len(q)] * (2 / motion.force.shape[1])
        force[0] /= 2
        left += force @ joint.directions
    external = np.zeros_like(q)
    external[: len(system.dynamic)] = state.level * system.dynamic
    external[0] += system.static
    return float(np.linalg.norm(left - external) / np.linalg.norm(external))


@pytest.mark.parametrize("damping", ["of the free structure", "modal", "coupled"])
def test_the_slope_of_the_condensed_receptance_equals_central_differences(damping: str) -> None:
    balance = HarmonicBalance(system=chain(damping), n_harmonic=4)
    slopes, below, above = balance.at_with_slopes(7.0).slopes, balance.at(7.0 - 1e-5), balance.at(7.0 + 1e-5)
    for name in ("columns", "dynamic"):
        difference = (getattr(above, name) - getattr(below, name)) / 2e-5
        exact = getattr(slopes, name)
        assert np.abs(exact).max() > 0
        # Round-off over the step.
        np.testing.assert_allclose(exact, difference, atol=1e-7 * np.abs(exact).max())


# ---- the arc


def test_the_arc_turns_twice_and_every_point_is_a_solution_of_its_own() -> None:
    balance = duffing()
    branch = frequency_response(balance, 0.8, 2.0)
    omega = branch.angular_frequency
    assert len(folds(omega)) == 2
    up, down = folds(omega)
    assert omega[up] > omega[down] > 1.0
    assert (np.diff(omega[up : down + 1]) < 0).all()  # the middle branch runs backwards
    assert (branch.residual_norm <= 1e-9).all()
    for point in range(1, len(omega), 4):
        start = branch.start(balance, point)
        state = steady_state(balance, float(omega[point]), start=start)
        np.testing.assert_allclose(state.coefficients, branch.coefficients[point], atol=1e-7)
        assert left_over(balance, state) < 1e-7


@pytest.fixture(scope="module")
def fold_frequencies() -> tuple[float, float]:
    """Of the Duffing oscillator with three harmonics, known to 1e-5."""
    fine = frequency_response(duffing(n_harmonic=4), 0.8, 2.0, step=1e-3).angular_frequency
    up, down = folds(fine)
    return float(fine[up]), float(fine[down])


@slow
@pytest.mark.parametrize("beyond", [1e-4, 1e-3])
def test_a_range_that_ends_just_beyond_a_fold_goes_round_both_folds(
    fold_frequencies: tuple[float, float], beyond: float
) -> None:
    balance = duffing(n_harmonic=4)
    up, down = fold_frequencies
    for first, last in ((0.8, up + beyond), (2.0, down - beyond)):
        branch = frequency_response(balance, first, last)
        assert branch.stop_reason is StopReason.REACHED
        assert len(folds(branch.angular_frequency)) == 2


def test_three_states_share_a_frequency_between_the_folds() -> None:
    balance = duffing()
    branch = frequency_response(balance, 0.8, 2.0)
    up, down = folds(branch.angular_frequency)
    between_folds = 0.3 * branch.angular_frequency[up] + 0.7 * branch.angular_frequency[down]
    crossings = np.flatnonzero(np.diff(np.sign(branch.angular_frequency - between_folds)))
    assert len(crossings) == 3
    amplitudes = [
        steady_state(balance, between_folds, start=branch.start(balance, point)).amplitude(0) for point in crossings
    ]
    assert amplitudes[0] > 1.05 * amplitudes[1] > 5 * amplitudes[2]


def test_both_directions_of_travel_find_the_same_curve() -> None:
    balance = duffing()
    there, back = frequency_response(balance, 0.8, 2.0), frequency_response(balance, 2.0, 0.8)
    for branch in (there, back):
        assert branch.stop_reason is StopReason.REACHED
    assert (back.angular_frequency[0], back.angular_frequency[-1]) == (2.0, 0.8)
    np.testing.assert_allclose(back.coefficients[[0, -1]], there.coefficients[[-1, 0]], atol=1e-8)
    # Steps differ, so the tops do by what lies between two points.
    np.testing.assert_allclose(back.amplitude(0).max(), there.amplitude(0).max(), rtol=5e-3)
    turns = [branch.angular_frequency[folds(branch.angular_frequency)] for branch in (there, back)]
    np.testing.assert_allclose(turns[0], turns[1][::-1], rtol=5e-3)


def test_a_point_of_a_branch_starts_its_own_state_and_that_of_a_finer_balance() -> None:
    balance = HarmonicBalance(system=chain("coupled"), n_harmonic=4)
    branch = frequency_response(balance, 8.0, 9.0, step=0.5)
    for point in (2, -1):
        state = steady_state(balance, float(branch.angular_frequency[point]), start=branch.start(balance, point))
        assert state.iterations <= 1  # the branch was solved to the same tolerance
        np.testing.assert_allclose(branch.start(balance, point), state.motion, atol=1e-8 * np.abs(state.motion).max())
    fine = HarmonicBalance(system=chain("coupled"), n_harmonic=6)
    start = branch.start(fine, -1)
    assert start.shape == (fine.n_direction, 11)
    np.testing.assert_array_equal(start[:, :7], branch.start(balance, -1))
    assert not start[:, 7:].any()
    assert steady_state(fine, 9.0, start=start).residual_norm < 1e-9
    coarse = HarmonicBalance(system=chain("coupled"), n_harmonic=3)
    np.testing.assert_array_equal(branch.start(coarse, -1), branch.start(balance, -1)[:, :5])


def test_the_step_is_the_largest_one_and_points_ascend_to_the_end() -> None:
    balance = HarmonicBalance(system=chain("modal"), n_harmonic=4)
    reports: list[tuple[float, float]] = []
    branch = frequency_response(balance, 4.0, 6.0, step=0.2, report=lambda done, way: reports.append((done, way)))
    assert np.abs(np.diff(branch.angular_frequency)).max() <= 0.2 * (1 + 1e-9)
    assert branch.angular_frequency[[0, -1]].tolist() == [4.0, 6.0]
    assert reports[-1] == (2.0, 2.0)


def test_a_branch_over_the_level_turns_twice_and_ends_in_the_state_of_that_level() -> None:
    balance = duffing()
    branch = level_response(balance, 1.1, 0.05, 6.0)
    assert len(folds(branch.level)) == 2
    assert (branch.angular_frequency == 1.1).all()
    end = steady_state(balance.at_level(6.0), 1.1, start=branch.start(balance, -1))
    np.testing.assert_allclose(branch.coefficients[-1], end.coefficients, atol=1e-7)
    assert end.level == branch.level[-1] == 6.0
    start = steady_state(balance.at_level(0.05), 1.1)
    np.testing.assert_allclose(branch.coefficients[0], start.coefficients, atol=1e-9)


@pytest.mark.parametrize(
    ("joint", "parameter", "last"),
    [
        ("rub", "friction_coefficient", 0.9),
        ("cubic", "stiffness", -50.0),
        ("rub", "tangential_stiffness", 70.0),
    ],
)
def test_a_branch_over_a_joint_parameter_ends_in_the_state_of_a_system_made_with_it(
    joint: str, parameter: str, last: float
) -> None:
    system = chain("coupled")
    balance, omega = HarmonicBalance(system=system, n_harmonic=4), 9.0
    number = [item.name for item in system.joints].index(joint)
    first = float(getattr(system.joints[number], parameter))
    branch = joint_response(balance, omega, joint, parameter, first, last)
    assert branch.stop_reason is StopReason.REACHED
    changed = list(system.joints)
    changed[number] = replace(changed[number], **{parameter: last})
    # The stuck stiffness of the two differs, which must not matter.
    made = HarmonicBalance(system=replace(system, joints=changed), n_harmonic=4)
    end = steady_state(made, omega, start=branch.start(balance, -1))
    scale = np.abs(end.coefficients).max()
    np.testing.assert_allclose(branch.coefficients[-1], end.coefficients, atol=1e-7 * scale)
    assert len(branch.iterations) < 80  # 50 largest steps: corrections converge fast, with the exact Jacobian
    assert np.abs(branch.coefficients[0] - end.coefficients).max() > 1e-3 * scale


# ---- stop, go on, keep

#: Sentences that files held before reasons were stored by name.
OLDER = (
    "reached the last value",
    "all 2 frequencies solved",
    "turned back beyond its first value, at 1 Hz",
    "the branch closes on itself and goes no further (it has left the one it began on), at 1 Hz",
    "reached 5000 points",
    "the corrections fail even for the smallest step, at 2 (level)",
)


@pytest.mark.parametrize("stop", [1, 2, 12])
def test_a_resumed_continuation_gives_the_same_bits(stop: int) -> None:
    continuation = Continuation(path=FrequencyPath(balance=duffing()), first=0.9, last=1.6)
    _, state = begin(continuation)
    whole = []
    kept = state
    while state.stop_reason is None:
        point, state = continuation.advance(state)
        if point is not None:
            whole.append(point)
        if state.n_point == stop:
            kept = state
    again, state = [], pickle.loads(pickle.dumps(kept))
    fresh = Continuation(path=FrequencyPath(balance=duffing()), first=0.9, last=1.6)
    while state.stop_reason is None:
        point, state = fresh.advance(state)
        if point is not None:
            again.append(point)
    assert len(again) == len(whole) - (stop - 1) > 20
    for one, other in zip(whole[stop - 1 :], again, strict=True):
        np.testing.assert_array_equal(one.coefficients, other.coefficients)
        assert one.angular_frequency == other.angular_frequency


def test_a_branch_survives_its_file(tmp_path: Path) -> None:
    balance = HarmonicBalance(system=chain("coupled"), n_harmonic=4)
    branch = frequency_response(balance, 4.0, 6.0, step=0.5)
    branch.save(tmp_path / "branch.nc")
    read = load_branch(tmp_path / "branch.nc")
    for name in ("angular_frequency", "coefficients", "residual_norm", "level", "iterations", "periodic_slider"):
        np.testing.assert_array_equal(getattr(read, name), getattr(branch, name), err_msg=name)
    np.testing.assert_array_equal(read.contact_share, branch.contact_share)
    assert read.contact_share.shape == (len(branch.angular_frequency), 6, 3)
    np.testing.assert_allclose(read.contact_share.sum(axis=2), 1)
    assert read.periodic_slider.shape[1] == balance.n_slider == 4
    assert (read.stop_reason, read.joint_names) == (branch.stop_reason, branch.joint_names)


def test_outputs_are_derivatives_of_the_displacement() -> None:
    branch = frequency_response(HarmonicBalance(system=chain("modal"), n_harmonic=4), 4.0, 5.0)
    row, omega = along(5, {3: 0.8, 4: 0.6}), branch.angular_frequency
    np.testing.assert_allclose(branch.output(row, 2), branch.coefficients[:, 2] @ row)
    np.testing.assert_allclose(branch.output(row, 2, 1), 2j * omega * branch.output(row, 2))
    np.testing.assert_allclose(branch.amplitude(3, 1, 2), omega**2 * np.abs(branch.coefficients[:, 1, 3]))
    np.testing.assert_allclose(branch.to_xarray().frequency, omega / (2 * np.pi))


def test_a_branch_that_turns_back_beyond_its_first_value_says_so() -> None:
    balance = duffing()
    whole = frequency_response(balance, 0.8, 2.0)
    _, down = folds(whole.angular_frequency)
    first = float(whole.angular_frequency[down]) + 0.02
    low = steady_state(balance, first)
    assert low.amplitude(0) < whole.amplitude(0)[down]  # on the lower branch
    continuation = Continuation(path=FrequencyPath(balance=balance), first=first, last=0.8)
    _, state = begin(continuation)
    while state.stop_reason is None:
        _, state = continuation.advance(state)
    assert state.stop_reason is StopReason.TURNED_BACK
    assert continuation.stopped_at(state) == f"{state.value / (2 * np.pi):.6g} Hz"
    assert state.value > first


@pytest.mark.parametrize("text", ["TURNED_BACK", "turned back beyond its first value, at 0.2 Hz"])
def test_a_stop_reason_is_stored_by_its_name_and_read_from_older_sentences(tmp_path: Path, text: str) -> None:
    branch = replace(
        frequency_response(duffing(n_harmonic=2), 0.8, 0.82), stop_reason=StopReason.TURNED_BACK, stopped_at="0.2 Hz"
    )
    file = tmp_path / "branch.nc"
    branch.save(file)
    with h5py.File(file, "r+") as data:
        assert data.attrs["stop_reason"] == "TURNED_BACK"
        data.attrs["stop_reason"] = text
    assert load_branch(file).stop_reason is StopReason.TURNED_BACK
    assert re.match(r"turned back.*, at 0\.2 Hz: ", load_branch(file).stop_message)
    # Older files have no isolas, do not count folds, and know neither drift nor states that do not repeat.
    newer = {StopReason.ISOLA, StopReason.FOLDED, StopReason.DRIFTED, StopReason.UNSETTLED}
    assert {StopReason.read(older) for older in OLDER} == set(StopReason) - newer
    with pytest.raises(BalanceError, match=r"weary.*FAILED"):
        StopReason.read("weary")


def test_a_branch_goes_on_from_what_was_saved() -> None:
    continuation, saved = Continuation(path=FrequencyPath(balance=duffing()), first=0.9, last=1.2), []
    whole = run(continuation, save=lambda progress: saved.append((list(progress[0]), progress[1])))
    again = run(continuation, resumed=saved[3])
    np.testing.assert_array_equal(again.coefficients, whole.coefficients)
    assert again.stop_reason is whole.stop_reason is StopReason.REACHED


def test_a_branch_stops_at_the_number_of_points_asked_for() -> None:
    continuation = Continuation(path=FrequencyPath(balance=duffing()), first=0.8, last=2.0, most_points=7)
    _, state = begin(continuation)
    while state.stop_reason is None:
        _, state = continuation.advance(state)
    assert (state.n_point, state.stop_reason) == (7, StopReason.MOST_POINTS)


def test_a_branch_that_folds_up_its_points_says_so() -> None:
    continuation = Continuation(path=FrequencyPath(balance=duffing()), first=0.8, last=2.0)
    first, state = begin(continuation)
    full = replace(state, stop_reason=StopReason.MOST_POINTS)
    for values, reason in (([0.8, 0.9, 1.0, 1.1], StopReason.MOST_POINTS), ([0.8, 1.0, 0.9, 1.1], StopReason.FOLDED)):
        assert follow_to_end(continuation, ([(value, first) for value in values], full))[2] is reason


def test_a_file_that_is_no_branch_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.nc").write_text("no data")
    with pytest.raises(BalanceError, match=r'notes\.nc" contains no response branch'):
        load_branch(tmp_path / "notes.nc")


@dataclass(frozen=True, kw_only=True, eq=False)
class BrokenPath(LevelPath):
    """A force that is half as large again from level 0.5 on: no curve leads across."""

    def at(self, value: float) -> tuple[HarmonicBalance, Condensed]:
        """See `Path`."""
        return super().at(value if value < 0.5 else 1.5 * value)


def test_a_curve_says_where_it_leaps(tmp_path: Path) -> None:
    slider = JenkinsElement(name="stuck", direction=np.ones(1), tangential_stiffness=1.0, limit_force=1e3)
    system = JointedSystem(
        mass=[[1.0]], damping=[[0.1]], stiffness=[[1.0]], joints=[slider], harmonic_force=[[0.0], [1.0]]
    )
    balance = HarmonicBalance(system=system, n_harmonic=2)
    whole = level_response(balance, 1.0, 0.1, 1.0)
    assert whole.stop_message == "reached the last value"
    branch = run(Continuation(path=BrokenPath(balance=balance, angular_frequency=1.0), first=0.1, last=1.0))
    (leap,) = branch.leaps
    # A stuck slider is a spring; |2 - 1 + 0.1 i| of the force to 1e-9.
    np.testing.assert_allclose(branch.amplitude(0), branch.level / abs(1 + 0.1j), rtol=1e-8)
    assert branch.level[leap - 1] < 0.5
    assert branch.level[leap] >= 0.75
    assert f"Hz, level {branch.level[leap]:.6g}, and jumps" in branch.stop_message
    branch.save(tmp_path / "branch.nc")
    assert load_branch(tmp_path / "branch.nc").leaps == branch.leaps
