"""Sweeps of a Duffing oscillator follow their own branch to its end, on grids far coarser than the jump."""

from typing import Any

import numpy as np
import pytest

from correlation.model import Model, Sensor
from correlation.model_solver import ModelSolver
from correlation.prediction import Points, Prediction, Predictor
from hbsolve.state_sequence import Track
from reduction.joint_law.cubic_spring import CubicSpring
from reduction.jointed_system import JointedSystem

#: One mode at 10 Hz with 1 % damping, whose linear peak is 1 m at this force.
OMEGA, ZETA = 2 * np.pi * 10.0, 0.01
FORCE = 2 * ZETA * OMEGA**2


def duffing(cubic: float) -> Model:
    """Harmonics 0 and 1 alone, whose balance has a closed form."""
    joint = CubicSpring(name="cubic", direction=np.ones(1), stiffness=cubic * OMEGA**2)
    force = np.zeros((2, 1))
    force[1, 0] = 1.0
    system = JointedSystem(
        mass=np.eye(1), damping=2 * ZETA * OMEGA * np.eye(1), stiffness=OMEGA**2 * np.eye(1), joints=[joint],
        harmonic_force=force,
    )  # fmt: skip
    return Model(system=system, sensors=(Sensor(name="x", row=np.ones(1)),), n_harmonic=2, n_sample=64)


def sweeps(cubic: float, frequency: np.ndarray, level: float = FORCE, before: Prediction | None = None) -> Prediction:
    n = len(frequency)
    points = Points(
        free=np.tile(False, 3 * n), level=np.full(3 * n, level), frequency=np.tile(frequency, 3),
        sensor=np.full(3 * n, "x"), harmonic=np.ones(3 * n, dtype=int), sweep=np.repeat([0, 1, -1], n),
    )  # fmt: skip
    return Predictor(points=points, sweeps=(1, -1)).predict(duffing(cubic), before)


def folds(cubic: float) -> tuple[float, float]:
    """Ends of the branch of the larger and of the smaller amplitude [Hz], from w^2(a) of the closed form."""
    a = np.linspace(0.08, 1.3, 400_001)
    stiffness = OMEGA**2 * (1 + 0.75 * cubic * a**2)
    middle = stiffness - 2 * (ZETA * OMEGA) ** 2
    square = middle**2 - stiffness**2 + (FORCE / a) ** 2
    middle, root = middle[square > 0], np.sqrt(square[square > 0])
    # Along the curve: rising amplitude below the resonance, falling amplitude above it.
    path = np.sqrt(np.concatenate([middle - root, (middle + root)[::-1]])) / (2 * np.pi)
    turns = path[1:-1][np.diff(np.sign(np.diff(path))) != 0]
    away, back = (turns.max(), turns.min()) if cubic > 0 else (turns.min(), turns.max())
    return float(away), float(back)


@pytest.mark.parametrize("cubic", [0.3, -0.2])
@pytest.mark.parametrize("n", [25, 80])
def test_a_sweep_jumps_where_its_branch_ends(cubic: float, n: int) -> None:
    frequency = np.linspace(8.5, 11.5, n)
    result = sweeps(cubic, frequency)
    away, back = folds(cubic)
    jumps = {jump.sweep: jump.frequency for jump in result.jumps}
    step = frequency[1] - frequency[0]
    # The smallest step is a 64th of a step of the sweep; close to the fold Newton's method may leap one before.
    assert jumps[1 if cubic > 0 else -1] == pytest.approx(away, abs=step / 16)
    assert jumps[-1 if cubic > 0 else 1] == pytest.approx(back, abs=step / 16)


@pytest.mark.parametrize("cubic", [0.3, -0.2])
def test_between_the_folds_each_row_is_of_its_own_branch(cubic: float) -> None:
    frequency = np.linspace(8.5, 11.5, 60)
    result = sweeps(cubic, frequency)
    mean, up, down = result.value.reshape(3, -1)
    ends = sorted(folds(cubic))
    inside = (frequency > ends[0] + 0.01) & (frequency < ends[1] - 0.01)
    assert inside.sum() > 5
    larger, smaller = (up, down) if cubic > 0 else (down, up)
    assert (np.abs(larger[inside]) > 1.5 * np.abs(smaller[inside])).all()
    # Outside there is one state, which Newton's method finds to 1e-9.
    outside = (frequency < ends[0] - 0.01) | (frequency > ends[1] + 0.01)
    np.testing.assert_allclose(up[outside], down[outside], rtol=1e-7)
    np.testing.assert_array_equal(mean, (up + down) / 2)
    # Both are states of the closed form: |D(a)| a = F with D of the complex amplitude.
    for x in (up, down):
        w = 2 * np.pi * frequency
        d = OMEGA**2 * (1 + 0.75 * cubic * np.abs(x) ** 2) - w**2 + 2j * ZETA * OMEGA * w
        np.testing.assert_allclose(d * x, FORCE, rtol=1e-6)


def test_a_linear_resonance_on_a_coarse_grid_has_no_jump() -> None:
    assert sweeps(0.2, np.linspace(8.5, 11.5, 13), level=FORCE / 100).jumps == ()


def test_steps_that_were_followed_for_a_model_nearby_are_not_followed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made = [0]
    solve = ModelSolver.follow_near

    def count(*arguments: Any) -> Track:
        made[0] += 1
        return solve(*arguments)

    monkeypatch.setattr(ModelSolver, "follow_near", count)
    frequency = np.linspace(8.5, 11.5, 13)
    before = sweeps(0.2, frequency, level=FORCE / 3)
    alone = made[0]
    again = sweeps(0.21, frequency, level=FORCE / 3, before=before)
    assert made[0] == alone > 0
    np.testing.assert_allclose(again.value, sweeps(0.21, frequency, level=FORCE / 3).value, rtol=1e-6)


@pytest.mark.parametrize("cubic", [0.24, 0.3, 0.36])
def test_a_jump_of_a_model_nearby_hides_none(cubic: float) -> None:
    frequency = np.linspace(8.5, 11.5, 25)
    alone = sweeps(cubic, frequency)
    result = sweeps(cubic, frequency, before=sweeps(0.3, frequency))
    # A state that Newton's method finds from two starts agrees to 1e-9 of the linear motion, a fold nearby enlarges it.
    np.testing.assert_allclose(result.value, alone.value, rtol=1e-6)
    step = (frequency[1] - frequency[0]) / 16
    for one, other in zip(result.jumps, alone.jumps, strict=True):
        assert one.sweep == other.sweep
        assert one.frequency == pytest.approx(other.frequency, abs=step)


@pytest.mark.parametrize("cubic", [0.06, 0.1, 0.2])
@pytest.mark.parametrize("n", [13, 40])
def test_beyond_the_cusp_states_do_not_depend_on_a_model_nearby_that_has_no_jump(n: int, cubic: float) -> None:
    frequency = np.linspace(8.5, 11.5, n)
    below = sweeps(0.04, frequency)
    assert below.jumps == ()
    assert below.followed
    alone = sweeps(cubic, frequency)
    assert alone.jumps
    np.testing.assert_allclose(sweeps(cubic, frequency, before=below).value, alone.value, rtol=1e-6)
