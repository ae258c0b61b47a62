"""Leakage: what a window makes of a mode, and modes that lines do not resolve; estimates are SciPy's."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal
from scipy.integrate import quad_vec

from correlation.modal.fit_modes import fit_modes
from correlation.modal.window import Window, compute_pole_response
from tests.slow import slow

Array = NDArray[np.float64]
#: Distance of the lines, and sampling rate [Hz].
STEP, RATE = 0.5, 512.0


def system(random: np.random.Generator, lines: float) -> tuple[Array, Array, Array]:
    """Two or three modes, about so many lines wide, at three sensors."""
    frequency = np.array([32.0, 55.0, 90.0])[: random.integers(2, 4)] * random.uniform(0.9, 1.1)
    frequency += STEP * random.uniform(-0.5, 0.5, len(frequency))
    damping = lines * STEP / 2 / frequency * random.uniform(0.8, 1.25, len(frequency))
    return frequency, damping, random.choice([-1, 1], (3, len(frequency))) * random.uniform(0.3, 1, (3, len(frequency)))


def estimate(random: np.random.Generator, modes: tuple[Array, Array, Array], averages: int) -> tuple[Array, Array]:
    """H1 of a record of noise under Hann's window, blocks that overlap by half."""
    block = int(RATE / STEP)
    force = random.standard_normal((averages + 9) * block // 2)
    moved = np.zeros((3, len(force)))
    for frequency, damping, shape in zip(modes[0], modes[1], modes[2].T, strict=True):
        omega = 2 * np.pi * frequency
        over, under, _ = signal.cont2discrete(([1.0], [1.0, 2 * damping * omega, omega**2]), 1 / RATE, "zoh")
        moved += np.outer(shape * shape[0], signal.lfilter(over.ravel(), under, force))
    force, moved = force[4 * block :], moved[:, 4 * block :]
    moved += 1e-3 * moved.std(axis=1, keepdims=True) * random.standard_normal(moved.shape)
    line, power = signal.welch(force, RATE, "hann", block)
    cross = signal.csd(force, moved, RATE, "hann", block)[1]
    band = (line > 15) & (line < 120)
    # A force that is held over a step is half a step late.
    return line[band], (cross / power * np.exp(1j * np.pi * line / RATE))[:, band]


@pytest.mark.parametrize("power", [0, 1, 2])
def test_the_response_of_a_pole_is_that_of_its_windowed_decay(power: int) -> None:
    duration, pole, s = 2.0, np.array([-1.3 + 40j]), 2j * np.pi * np.array([[3.0], [6.0], [6.5]])
    instants = np.linspace(0, duration, 4001)
    hann = np.sin(np.pi * instants / duration) ** 2
    correlation = np.correlate(hann, hann, "full")[len(hann) - 1 :] / (hann @ hann)
    # What follows a pulse, p^k e^{p t}, is windowed; the pulse itself is not.
    late = quad_vec(lambda t: np.interp(t, instants, correlation) * np.exp((pole - s) * t), 0, duration)[0]
    expected = pole**power * late + (s**power - pole**power) / (s - pole)
    value, slope = compute_pole_response(s, pole, power, duration)
    np.testing.assert_allclose(value, expected, rtol=1e-6)  # straight lines between 4001 points
    step = 1e-5
    above, below = (compute_pole_response(s, pole + side, power, duration)[0] for side in (step, -step))
    np.testing.assert_allclose(slope, (above - below) / (2 * step), rtol=1e-7)


@pytest.mark.parametrize(("lines", "seed"), [(0.5, 1), pytest.param(2.0, 4, marks=slow)])
def test_a_narrow_mode_under_a_window_stays_one(lines: float, seed: int) -> None:
    random = np.random.default_rng(40_000 + seed)
    modes = system(random, lines)
    line, values = estimate(random, modes, averages=60)
    for window in (Window.UNKNOWN, Window.HANN):
        result = fit_modes(line, values, quantity="displacement", window=window)
        assert len(result.frequency) == len(modes[0])
        # As benchmarks do, with their own deviations: four of some ten by chance in 1 of 1000.
        np.testing.assert_array_less(np.abs(result.frequency - modes[0]), 4 * result.frequency_deviation)
        np.testing.assert_array_less(np.abs(result.damping_ratio - modes[1]), 4 * result.damping_deviation)
        # Leakage alone doubles the damping of modes of one line and more of narrower ones.
        np.testing.assert_allclose(result.damping_ratio, modes[1], rtol=0.4)


def test_narrow_modes_without_a_window_are_exact_and_said_to_be_narrow() -> None:
    frequency, damping, shapes = system(np.random.default_rng(5), 0.7)
    line = np.arange(15.0, 120.0, STEP)
    omega, own = 2 * np.pi * line[:, None], 2 * np.pi * frequency
    values = (shapes * shapes[0]) @ (1 / (own**2 - omega**2 + 2j * damping * own * omega)).T
    result = fit_modes(line, values, quantity="displacement")
    np.testing.assert_allclose(result.frequency, frequency, rtol=1e-9)
    np.testing.assert_allclose(result.damping_ratio, damping, rtol=1e-6)
    assert len(result.remarks) == len(frequency)
    assert "half-power bandwidth" in result.remarks[0]
