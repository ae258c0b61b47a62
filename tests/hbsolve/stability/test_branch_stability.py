"""Bifurcations along branches: where they are, of which kind, and what the integration in time does beyond them."""

from dataclasses import replace

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response, joint_response, level_response
from hbsolve.errors import BalanceError
from hbsolve.stability.branch_stability import Bifurcation, branch_stability
from reduction.jointed_system import CubicSpring, ElasticStop, JenkinsElement, JointedSystem, PolynomialSpring
from tests.hbsolve.stability.test_stability import van_der_pol
from tests.slow import slow
from transient.state import start_from
from transient.steady import steady_motion


def duffing(load: float, damping: float = 0.05, cubic: float = 0.5, stiffness: float = 1.0) -> JointedSystem:
    spring = CubicSpring(name="cubic", direction=[1.0], stiffness=cubic)
    return JointedSystem(
        mass=[[1.0]], damping=[[damping]], stiffness=[[stiffness]], joints=[spring], harmonic_force=[[0.0], [load]]
    )


def test_folds_of_a_duffing_curve_are_where_it_turns() -> None:
    balance = HarmonicBalance(system=duffing(0.3), n_harmonic=8)
    branch = frequency_response(balance, 0.5, 3.0, step=0.005)
    result = branch_stability(balance, branch, n_sample=512)
    assert [item.kind for item in result.bifurcations] == [Bifurcation.FOLD, Bifurcation.FOLD]
    upper, lower = (item.state.angular_frequency for item in result.bifurcations)
    # The turns of the curve itself: vertices of parabolas through three points, over the phase, which goes on.
    omega = branch.angular_frequency
    way = np.diff(omega)
    turns = [int(i) + 1 for i in np.flatnonzero(way[:-1] * way[1:] < 0)]
    for found, turn in zip((upper, lower), turns, strict=True):
        phase, near = np.angle(branch.output(0)[turn - 1 : turn + 2]), omega[turn - 1 : turn + 2]
        vertex = np.polyfit(phase, near, 2)
        assert found == pytest.approx(np.polyval(vertex, -vertex[1] / (2 * vertex[0])), rel=5e-5)  # of the parabolas
    between = slice(result.bifurcations[0].index + 1, result.bifurcations[1].index + 1)
    assert set(result.n_unstable[between].tolist()) == {1}
    assert result.is_stable[: between.start].all()
    assert result.is_stable[between.stop :].all()
    assert abs(result.bifurcations[0].multiplier - 1) < 1e-4


@slow
def test_folds_over_the_level_are_near_those_of_one_harmonic() -> None:
    """With H = 1 amplitudes a obey ((k - w^2 + 3/4 c a^2)^2 + (d w)^2) a^2 = F^2; folds are its extrema in F."""
    balance = HarmonicBalance(system=duffing(1.0), n_harmonic=8)
    omega, damping, cubic = 1.6, 0.05, 0.5
    branch = level_response(balance, omega, 0.01, 2.0)
    result = branch_stability(balance, branch)
    a = np.linspace(0.01, 3, 400_001)
    force = a * np.sqrt((1 - omega**2 + 0.75 * cubic * a**2) ** 2 + (damping * omega) ** 2)
    way = np.diff(force)
    folds = force[1:-1][way[:-1] * way[1:] < 0]
    assert [item.kind for item in result.bifurcations] == [Bifurcation.FOLD] * 2
    levels = [item.state.level for item in result.bifurcations]
    # The third harmonic is some per cent of the first.
    assert levels == pytest.approx(folds, rel=0.05)


def test_period_doubling_begins_a_motion_of_two_periods() -> None:
    spring = PolynomialSpring(name="j", direction=[1.0], quadratic=0.6, cubic=0.1, quartic=0.0, quintic=0.0)
    system = JointedSystem(
        mass=[[1.0]], damping=[[0.08]], stiffness=[[1.0]], joints=[spring], harmonic_force=[[0.0], [1.0]]
    )
    balance = HarmonicBalance(system=system, n_harmonic=16)
    branch = level_response(balance, 1.9, 0.05, 1.5)
    result = branch_stability(balance, branch)
    doubled = [item for item in result.bifurcations if item.kind is Bifurcation.PERIOD_DOUBLING]
    assert doubled
    first = doubled[0]
    assert first.multiplier == pytest.approx(-1, abs=1e-4)
    for share, multiple in ((0.97, 1), (1.05, 2)):
        level = share * first.state.level
        start = start_from(system, 1.9, first.state.coefficients * share)
        assert steady_motion(system, 1.9, start, level, tolerance=1e-6).period_multiple == multiple


@slow
def test_a_self_excited_oscillator_locks_to_the_load_at_a_neimark_sacker_point() -> None:
    system = JointedSystem(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1.0]],
        joints=[van_der_pol(name="j", direction=[1.0], strength=0.3)], harmonic_force=[[0.0], [1.0]],
    )  # fmt: skip
    balance = HarmonicBalance(system=system, n_harmonic=12)
    branch = level_response(balance, 1.5, 3.0, 0.2)
    result = branch_stability(balance, branch)
    point = next(item for item in result.bifurcations if item.kind is Bifurcation.NEIMARK_SACKER)
    assert abs(point.multiplier) == pytest.approx(1, abs=1e-4)
    for share, locked in ((1.1, True), (0.9, False)):
        level = share * point.state.level
        start = start_from(system, 1.5, point.state.coefficients)
        assert steady_motion(system, 1.5, start, level, max_period=800).periodic == locked


@slow
def test_a_symmetric_oscillator_loses_its_symmetry_at_a_branch_point() -> None:
    balance = HarmonicBalance(system=duffing(1.0, damping=0.1, cubic=1.0, stiffness=1e-3), n_harmonic=16)
    branch = level_response(balance, 0.6, 0.2, 8.0)
    result = branch_stability(balance, branch)
    crossed = [item for item in result.bifurcations if item.kind is Bifurcation.BRANCH_POINT]
    assert crossed
    # The mean is zero on the symmetric branch, however far it is followed.
    assert np.abs(branch.coefficients[:, 0]).max() < 1e-6 * np.abs(branch.coefficients).max()


def test_bad_input_is_one_sentence() -> None:
    balance = HarmonicBalance(system=duffing(0.3), n_harmonic=4)
    branch = frequency_response(balance, 0.5, 0.7)
    with pytest.raises(BalanceError, match="give the balance with which it was found"):
        branch_stability(HarmonicBalance(system=duffing(0.3), n_harmonic=6), branch)
    slider = JenkinsElement(name="rub", direction=[1.0], tangential_stiffness=1.0, limit_force=0.3)
    other = HarmonicBalance(system=replace(duffing(0.3), joints=[slider]), n_harmonic=4)
    with pytest.raises(BalanceError, match="joints cubic with 0 sliders, the balance rub with 1"):
        branch_stability(other, branch)
    with pytest.raises(BalanceError, match="neither frequency nor level changes"):
        branch_stability(balance, joint_response(balance, 0.6, "cubic", "stiffness", 0.5, 0.7))


def test_a_change_of_stability_is_listed_wherever_it_is() -> None:
    """Also where contacts make multipliers jump, or no state is found between two points."""
    stop = ElasticStop(name="stop", direction=[1.0], stiffness=20.0, gap=0.5)
    balance = HarmonicBalance(system=replace(duffing(1.0), joints=[stop]), n_harmonic=8)
    for omega in (0.55, 0.7):
        result = branch_stability(balance, level_response(balance, omega, 0.05, 2.0), n_sample=512)
        changes = np.flatnonzero(np.diff(result.n_unstable)).tolist()
        assert changes
        assert [item.index for item in result.bifurcations] == changes
