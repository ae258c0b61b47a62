"""Branches of random oscillators whose branches are known in closed form: `benchmarks.random_oscillators`."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.random_oscillators import Oscillator, Response, Sweeps, draw_oscillator, measure
from correlation.feature.branch import find_minority, separate_branches
from correlation.feature.curve import CurveSet
from correlation.feature.jump import find_curve_jumps
from correlation.noise.smoothness import estimate_curve_noise
from tests.slow import slow

#: Seeds on which no constant was set.
SEEDS = range(7000, 7008)


def curve_set(sweeps: Sweeps, *, has_phase: bool = True) -> CurveSet:
    n_repeat, n = sweeps.value.shape[1:]
    value = sweeps.value.reshape(2 * n_repeat, n)
    return CurveSet(
        free=False, level=1.0, sensor="tip", has_phase=has_phase, frequency=sweeps.frequency,
        sweep=np.repeat([1, -1], n_repeat), repeat=np.tile(np.arange(n_repeat), 2),
        value=value if has_phase else np.abs(value).astype(complex),
    )  # fmt: skip


@cache
def draw(kind: str, seed: int, n_repeat: int) -> tuple[Oscillator, float, Sweeps]:
    """An oscillator, its force and its sweeps, drawn once for all tests."""
    random = np.random.default_rng([seed, n_repeat])
    one, force = draw_oscillator(kind, random)
    noise, jitter = 10 ** random.uniform(-3.5, -1.5), 10 ** random.uniform(-5, -3)
    return one, force, measure(one, force, random, n_repeat=n_repeat, noise=noise, jitter=jitter)


@cache
def up_and_down(kind: str, seed: int, n_repeat: int) -> tuple[Response, Response]:
    """Exact responses of both directions of the sweep at the nominal frequencies."""
    one, force, sweeps = draw(kind, seed, n_repeat)
    return one.sweep(force, sweeps.frequency, 1), one.sweep(force, sweeps.frequency, -1)


@pytest.mark.parametrize("has_phase", [True, False])
@pytest.mark.parametrize("n_repeat", [1, pytest.param(3, marks=slow)])
@pytest.mark.parametrize("kind", ["hardening", "softening", "gap", "linear", "friction"])
def test_states_with_two_branches_are_split_and_others_are_not(kind: str, n_repeat: int, has_phase: bool) -> None:
    missed = single = wrong = bistable = 0
    for seed in SEEDS:
        _, _, sweeps = draw(kind, seed, n_repeat)
        result = separate_branches(curve_set(sweeps, has_phase=has_phase))
        up, down = up_and_down(kind, seed, n_repeat)
        if not has_phase:
            up, down = np.abs(up), np.abs(down)
        apart, size = np.abs(up - down), np.maximum(np.abs(up), np.abs(down))
        # Beside a jump the jitter of a repeat decides; below ten standard deviations the noise does.
        steady = np.abs(sweeps.exact - sweeps.exact[:, :1]).max(axis=(0, 1)) < 0.3 * size
        clear = apart > 10 * np.sqrt(2) * np.hypot(sweeps.noise * size, sweeps.floor)
        both = (apart > 0.15 * size) & steady & clear
        bistable, missed = bistable + both.sum(), missed + (both & ~result.bistable).sum()
        alone = steady & (apart < 1e-6 * size)
        single, wrong = single + alone.sum(), wrong + (alone & result.bistable).sum()
    # On 375 sets of other seeds none of some 1,200 states was missed, and 7 of 25,000 were split by mistake.
    assert missed <= 0.02 * bistable
    assert wrong <= 0.005 * single
    assert (bistable > 0) == (kind in {"hardening", "softening", "gap"})


def test_a_drift_of_the_resonance_between_sweeps_is_no_second_branch() -> None:
    one = Oscillator(kind="linear", frequency=50.0, damping=0.005)
    frequency, random = np.linspace(48, 52, 60), np.random.default_rng(1)
    # A tenth of the half-power width, by which the flanks differ by 14 %.
    value = np.array([replace(one, frequency=50.0 * by).sweep(1.0, frequency, 1) for by in (1.0, 1.001)])
    assert (np.abs(value[0] - value[1]) > 0.1 * np.abs(value[0])).any()
    value *= 1 + 1e-3 * (random.standard_normal(value.shape) + 1j * random.standard_normal(value.shape))
    curves = CurveSet(
        free=False, level=1.0, sensor="tip", has_phase=True, frequency=frequency, sweep=np.array([1, -1]),
        repeat=np.array([1, 1]), value=value,
    )  # fmt: skip
    assert not separate_branches(curves).bistable.any()


def test_the_repeat_that_jumped_earlier_is_recognised() -> None:
    random = np.random.default_rng(3)
    one = Oscillator(kind="hardening", frequency=50.0, damping=0.005, strength=0.05)
    force = 0.01 * (2 * np.pi * 50.0) ** 2
    frequency = np.linspace(48, 54, 80)
    value = np.array([one.sweep(force, frequency, 1)] * 3)
    (jump,) = find_curve_jumps(frequency, value[0])
    value[1, jump - 2 : jump + 1] = one.sweep(force, frequency, -1)[jump - 2 : jump + 1]
    value *= 1 + 1e-3 * random.standard_normal(value.shape)
    curves = CurveSet(
        free=False, level=1.0, sensor="tip", has_phase=True, frequency=frequency, sweep=np.ones(3, dtype=int),
        repeat=np.arange(3), value=value,
    )  # fmt: skip
    result = separate_branches(curves)
    np.testing.assert_array_equal(np.argwhere(result.excluded), [[1, jump - 2], [1, jump - 1], [1, jump]])
    assert not result.bistable.any()


def test_half_of_the_repeats_are_no_majority() -> None:
    value, noise = np.array([1.0, 1.01, 0.4, 0.41], dtype=complex), np.full(4, 1e-3)
    np.testing.assert_array_equal(find_minority(value, noise), [True] * 4)
    np.testing.assert_array_equal(find_minority(value[:3], noise[:3]), [False, False, True])
    np.testing.assert_array_equal(find_minority(value[:2], noise[:2]), [False, False])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("value", [np.zeros(12, dtype=complex), np.ones(6, dtype=complex)])
def test_a_curve_of_zeros_and_a_short_one_tell_no_noise(value: np.ndarray) -> None:
    deviation, freedom = estimate_curve_noise(np.linspace(90.0, 100.0, len(value)), value)
    np.testing.assert_array_equal(deviation, np.full(len(value), np.nan))
    assert freedom == 0


@pytest.mark.parametrize("has_phase", [True, False])
@pytest.mark.parametrize("kind", ["hardening", "softening", "gap", "linear", "friction"])
def test_the_noise_of_a_single_curve_is_estimated(kind: str, has_phase: bool) -> None:
    ratio = []
    for seed in SEEDS:
        _, _, sweeps = draw(kind, seed, 1)
        for exact, value in zip(sweeps.exact[:, 0], sweeps.value[:, 0], strict=True):
            seen = value if has_phase else np.abs(value).astype(complex)
            deviation, freedom = estimate_curve_noise(sweeps.frequency, seen, parts=2 if has_phase else 1)
            assert freedom > 10
            ratio.append(np.median(deviation / np.hypot(sweeps.noise * np.abs(exact), sweeps.floor)))
    # On 600 other curves nine of ten were within a factor of 0.7 and 1.8, all kinds together.
    assert 0.8 < np.median(ratio) < 1.3
    assert np.mean((np.array(ratio) > 0.5) & (np.array(ratio) < 2.5)) > 0.9
