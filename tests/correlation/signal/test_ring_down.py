"""Free decays of oscillators whose backbones are known in closed form, integrated in time."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from correlation.errors import CampaignError
from correlation.signal.ring_down import RingDown, analyse_ring_down
from reduction.jointed_system import JenkinsElement, JointedSystem
from tests.slow import slow
from transient.integrate import integrate
from transient.state import TransientState

Array = NDArray[np.float64]
RATE = 4000.0
TIME = np.arange(8000) / RATE


def damped(frequency: float, damping: float, amplitude: float = 1.0, phase: float = 0.3) -> Array:
    own = 2 * np.pi * frequency
    poles = own * (-damping + 1j * np.sqrt(1 - damping**2))
    decay: Array = (amplitude * np.exp(poles * TIME + 1j * phase)).real
    return decay


def noise(seed: int, share: float = 0.01) -> Array:
    return share * np.random.default_rng(seed).standard_normal(len(TIME))


def at(mode: RingDown, displacement: Array) -> tuple[Array, Array]:
    order = np.argsort(mode.displacement)
    return (
        np.interp(displacement, mode.displacement[order], mode.frequency[order]),
        np.interp(displacement, mode.displacement[order], mode.damping_ratio[order]),
    )


@pytest.mark.parametrize(("damping", "offset"), [(0.002, 3.0), (0.01, 0.0), (0.05, 3.0)])
def test_a_linear_mode_in_noise(damping: float, offset: float) -> None:
    (mode,) = analyse_ring_down(TIME, damped(122.0, damping) + noise(0) + offset)
    # Targets of the whole; a linear mode is far better.
    np.testing.assert_allclose(mode.frequency, 122.0, rtol=1e-3)
    np.testing.assert_allclose(mode.damping_ratio, damping, rtol=0.05)
    assert mode.amplitude[0] > 20 * mode.amplitude[-1]


@pytest.mark.parametrize(("second", "amplitude"), [(244.0, 0.5), pytest.param(128.0, 1.0, marks=slow)])
def test_two_modes_close_or_at_an_octave_are_told_apart(second: float, amplitude: float) -> None:
    values = damped(122.0, 0.005) + damped(second, 0.004, amplitude, 2.0) + noise(1)
    modes = analyse_ring_down(TIME, values)
    assert len(modes) == 2
    for mode, frequency, damping in zip(modes, (122.0, second), (0.005, 0.004), strict=True):
        np.testing.assert_allclose(mode.frequency, frequency, rtol=1e-3)
        np.testing.assert_allclose(mode.damping_ratio, damping, rtol=0.05)


@pytest.mark.parametrize("frequencies", [None, [100.0]])
def test_a_mode_far_above_does_not_fold_onto_the_mode_that_is_read(frequencies: list[float] | None) -> None:
    # 204800 samples, 512 per period: every 32nd is kept, at 1600 Hz, where 1500 Hz looks like 100 Hz.
    time = np.arange(4 * 51200) / 51200
    high = 0.5 * np.exp(-2 * np.pi * 1500 * 0.0003 * time) * np.cos(2 * np.pi * 1500 * time)
    low = np.exp(-2 * np.pi * 100 * 0.003 * time) * np.cos(2 * np.pi * 100 * time)
    random = 0.01 * np.random.default_rng(6).standard_normal(len(time))
    (mode,) = analyse_ring_down(time, low + high + random, frequencies=frequencies)
    np.testing.assert_allclose(mode.frequency, 100.0, rtol=1e-3)
    np.testing.assert_allclose(mode.damping_ratio, 0.003, rtol=0.05)
    # Low noise that is spread over 25600 Hz: the mode is followed to a small share of its amplitude.
    assert mode.amplitude[-1] < 0.01


@cache
def duffing_decay(own: float, damping: float, cubic: float) -> Array:
    """Displacement and velocity of a decay from 1 m."""
    result = solve_ivp(
        lambda _, y: [y[1], -2 * damping * own * y[1] - own**2 * (y[0] + cubic * y[0] ** 3)],
        (0, TIME[-1]), [1.0, 0.0], t_eval=TIME, rtol=1e-9, atol=1e-12,
    )  # fmt: skip
    decay: Array = result.y
    return decay


@pytest.mark.parametrize(
    "quantity", ["acceleration", *(pytest.param(name, marks=slow) for name in ("displacement", "velocity"))]
)
def test_a_duffing_oscillator_has_its_backbone_and_constant_damping(quantity: str) -> None:
    own, damping, cubic = 2 * np.pi * 100.0, 0.005, 0.15
    x, v = duffing_decay(own, damping, cubic)
    signals = {"displacement": x, "velocity": v}
    signals["acceleration"] = -2 * damping * own * v - own**2 * (x + cubic * x**3)
    clean = signals[quantity]
    (mode,) = analyse_ring_down(TIME, clean + np.abs(clean).max() * noise(2), quantity=quantity)
    places = np.geomspace(0.05, 0.9, 8)
    frequency, ratio = at(mode, places)
    # One harmonic: omega^2 = own^2 (1 + 3/4 cubic A^2), off by 3/128 (cubic A^2)^2 / 8 < 1e-4; viscous damping is
    # c / (2 m omega).
    backbone = 100.0 * np.sqrt(1 + 0.75 * cubic * places**2)
    np.testing.assert_allclose(frequency, backbone, rtol=1e-3)
    np.testing.assert_allclose(ratio, damping * 100.0 / backbone, rtol=0.05)


@pytest.mark.parametrize("share", [0.001, pytest.param(0.0, marks=slow)])
def test_no_period_is_lost_where_little_noise_is(share: float) -> None:
    """A fit that foretold half of the decay lost a period there: 219 Hz at the end, with 0.05 % of residual."""
    damping, cubic = 0.002714, 0.1679
    (mode,) = analyse_ring_down(TIME, duffing_decay(2 * np.pi * 100.0, damping, cubic)[0] + noise(3, share))
    places = np.geomspace(0.07, 0.75, 10)
    backbone = 100.0 * np.sqrt(1 + 0.75 * cubic * places**2)
    frequency, ratio = at(mode, places)
    np.testing.assert_allclose(frequency, backbone, rtol=1e-3)
    np.testing.assert_allclose(ratio, damping * 100.0 / backbone, rtol=0.05)


def jenkins_decay(stiffness: float, slip: float) -> tuple[Array, Array]:
    """An oscillator of 1 kg and 100 Hz with 0.2 % damping beside one Jenkins element."""
    own = (2 * np.pi * 100.0) ** 2
    system = JointedSystem(
        mass=np.eye(1),
        damping=np.array([[2 * 0.002 * np.sqrt(own)]]),
        stiffness=np.array([[own]]),
        joints=[
            JenkinsElement(
                name="friction", direction=np.ones(1), tangential_stiffness=stiffness * own,
                limit_force=stiffness * own * slip,
            )
        ],
    )  # fmt: skip
    start = TransientState(displacement=np.array([2e-3]), velocity=np.zeros(1), slider=np.zeros(1))
    motion = integrate(system, 2 * np.pi * 100.0, 150, 100, start, 0.0, outputs={"x": np.ones(1)})
    return motion.time, motion.output_displacement["x"]


@pytest.mark.parametrize("share", [0.003, pytest.param(0.0, marks=slow)])
def test_a_jenkins_oscillator_has_the_closed_form_of_one_harmonic(share: float) -> None:
    stiffness, slip = 0.03, 2e-4
    time, x = jenkins_decay(stiffness, slip)
    random = np.random.default_rng(3)
    (mode,) = analyse_ring_down(time, x + share * np.abs(x).max() * random.standard_normal(len(x)))
    # Within 30 % of the onset of slip the damping triples during a few periods, and noise smooths it.
    places = np.geomspace(1.3 * slip, 1.5e-3, 8)
    angle = np.arccos(1 - 2 * slip / places)
    secant = stiffness * (angle - np.sin(2 * angle) / 2) / np.pi
    backbone = 100.0 * np.sqrt(1 + secant)
    work = 4 * stiffness * slip * (places - slip)
    ratio = 0.002 * 100.0 / backbone + work / (2 * np.pi * (1 + secant) * places**2)
    frequency, result = at(mode, places)
    np.testing.assert_allclose(frequency, backbone, rtol=1e-3)
    np.testing.assert_allclose(result, ratio, rtol=0.05 if share == 0 else 0.1)


def test_the_decay_after_a_steady_state_is_found() -> None:
    decay = damped(122.0, 0.01)
    steady = np.cos(2 * np.pi * 122.0 * np.arange(-4000, 0) / RATE + 0.3)
    values = np.concatenate([steady, decay])
    (mode,) = analyse_ring_down(
        np.arange(len(values)) / RATE, values + 0.003 * np.random.default_rng(4).standard_normal(len(values))
    )
    assert mode.start == pytest.approx(1.0, abs=0.03)
    np.testing.assert_allclose(mode.damping_ratio, 0.01, rtol=0.05)


def test_deviations_are_the_scatter_of_repeats() -> None:
    scores = []
    for seed in range(5):
        (mode,) = analyse_ring_down(TIME, damped(122.0, 0.01) + noise(100 + seed))
        scores.append(
            [
                (mode.frequency[0] - 122) / mode.frequency_deviation[0],
                (mode.damping_ratio[0] - 0.01) / mode.damping_deviation[0],
            ]
        )
    # Variance of 10 normal scores: 1 +- 0.45.
    assert 0.3 < np.mean(np.square(scores)) < 2.2


@pytest.mark.parametrize(
    ("values", "quantity", "word"),
    [
        (np.zeros(8000), "displacement", "throughout"),
        (noise(5), "displacement", "oscillates"),
        (damped(122.0, 0.01), "strain", "strain"),
        (np.ones((2, 8000)), "displacement", "one channel"),
    ],
)
def test_unusable_records_are_refused(values: Array, quantity: str, word: str) -> None:
    with pytest.raises(CampaignError, match=word):
        analyse_ring_down(TIME, values, quantity=quantity)


def test_a_clock_that_skips_is_refused() -> None:
    time = TIME.copy()
    time[4000:] += 0.01
    with pytest.raises(CampaignError, match="steps of time"):
        analyse_ring_down(time, damped(122.0, 0.01))
