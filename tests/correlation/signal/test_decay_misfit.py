"""Decays whose beginning no function of the amplitude describes, before a part in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.decay_misfit import DecayMisfit, find_fault, measure_misfit
from correlation.signal.free_decay import find_decay, guess_modes
from correlation.signal.ring_down import analyse_ring_down
from correlation.signal.slow_flow import fit_slow_flows
from tests.slow import slow

Array = NDArray[np.float64]
TIME = np.arange(6400) / 3200
FREQUENCY, DAMPING = 80.86, 0.00236
#: End of the part that no function of the amplitude describes [s].
ENTANGLED = 0.04


def entangled_decay(seed: int) -> Array:
    """A linear mode in noise of 0.3 %, whose amplitude and phase wander by chance in the beginning."""
    random = np.random.default_rng(seed)
    places = np.linspace(0, ENTANGLED, 7)
    before = TIME < ENTANGLED
    wander = np.zeros((2, len(TIME)))
    for part, size in zip(wander, (0.6, 1.5), strict=True):
        part[before] = np.interp(TIME[before], places, [*(size * random.standard_normal(6)), 0.0])
    own = 2 * np.pi * FREQUENCY
    phase = own * np.sqrt(1 - DAMPING**2) * TIME + 0.3 + wander[1]
    burst = np.where(before, 2 * np.cos(2 * np.pi * 260 * TIME) * (1 - TIME / ENTANGLED), 0.0)
    signal = np.exp(-DAMPING * own * TIME + wander[0]) * np.cos(phase) + burst
    return np.asarray(signal + 0.003 * random.standard_normal(len(TIME)))


@slow
@pytest.mark.parametrize("seed", [0, 1])
def test_a_decay_is_read_from_where_its_mode_follows_its_amplitude(seed: int) -> None:
    modes = analyse_ring_down(TIME, entangled_decay(seed))
    mode = min(modes, key=lambda item: abs(float(item.frequency[-1]) - FREQUENCY))
    inner = slice(5, 55)
    # Three standard deviations, beside the differences that no reading tells (1e-4, 2 %).
    frequency = np.hypot(mode.frequency_deviation, 1e-4 * FREQUENCY)[inner]
    damping = np.hypot(mode.damping_deviation, 0.02 * DAMPING)[inner]
    assert (np.abs(mode.frequency[inner] - FREQUENCY) < 3 * frequency).all()
    assert (np.abs(mode.damping_ratio[inner] - DAMPING) < 3 * damping).all()
    # Not because nothing is known of it: the tail alone gives both to better than this.
    assert np.median(damping) < 0.05 * DAMPING
    assert ENTANGLED / 2 < mode.start < 0.5
    assert any(f"{mode.start:.4g} s" in text for text in mode.remarks)


def test_a_start_that_is_given_is_kept() -> None:
    (mode,) = analyse_ring_down(TIME, entangled_decay(0), start=0.05)
    # A low-pass that uses nothing before the start reaches over half a period of the decay.
    assert 0.05 <= mode.start < 0.05 + 0.5 / FREQUENCY
    assert not mode.remarks


def test_a_weak_mode_that_is_none_costs_no_part_of_the_decay() -> None:
    """Else it is read from where the weak one has gone, 0.2 s later."""
    random = np.random.default_rng(0)
    jumps = np.cumsum(random.choice([-1.0, 1.0], 64)).repeat(len(TIME) // 64)
    weak = 0.06 * np.exp(-8 * TIME) * np.cos(2 * np.pi * 312 * TIME + jumps)
    strong = np.exp(-DAMPING * 2 * np.pi * FREQUENCY * TIME) * np.cos(2 * np.pi * FREQUENCY * TIME)
    (mode,) = analyse_ring_down(TIME, strong + weak + 0.003 * random.standard_normal(len(TIME)), frequencies=[80, 312])
    assert mode.start < 3 / FREQUENCY
    assert abs(float(mode.frequency[0]) / FREQUENCY - 1) < 3e-4
    assert any("312" in text and "left out" in text for text in mode.remarks)


@pytest.mark.parametrize(
    ("apart", "sentence"), [(0.05, "closer than the"), (0.0, "closer than the"), (0.7, "cannot be separated from")]
)
def test_two_modes_that_are_one_are_refused(apart: float, sentence: str) -> None:
    """Modes nearer than they decay fit a single one at any size, as 10 and -9 times its own."""
    own = np.exp(-0.02 * 2 * np.pi * FREQUENCY * TIME) * np.cos(2 * np.pi * FREQUENCY * TIME)
    noisy = own + 3e-3 * np.random.default_rng(0).standard_normal(len(TIME))
    with pytest.raises(CampaignError, match=sentence):
        analyse_ring_down(TIME, noisy, start=0.05, frequencies=[FREQUENCY, FREQUENCY + apart])


@slow
def test_a_record_that_no_mode_describes_is_refused_with_the_remedy() -> None:
    # The phase turns back by a radian every tenth of a second.
    jumps = np.cumsum(np.random.default_rng(2).choice([-1.0, 1.0], 20)).repeat(len(TIME) // 20)
    signal = np.exp(-TIME) * np.cos(2 * np.pi * FREQUENCY * TIME + jumps)
    with pytest.raises(CampaignError, match="start"):
        analyse_ring_down(TIME, signal, frequencies=[FREQUENCY])


@pytest.mark.parametrize(
    ("frequency", "damping", "deviation", "share", "word"),
    [
        ((80.0, 81.0), (0.002, 0.02), 0.001, 0.001, ""),
        ((276.0, 657.0), (0.002, 0.02), 0.001, 0.001, "657"),
        ((80.0, 81.0), (-0.076, 0.02), 0.001, 0.001, "-7.6"),
        ((80.0, 81.0), (0.002, 0.94), 0.001, 0.001, "94"),
        ((80.0, 81.0), (0.002, 0.02), 0.6, 0.001, "60"),
        ((80.0, 81.0), (0.002, 0.02), 0.001, 0.5, "50"),
    ],
)
def test_what_is_no_mode_is_said(
    frequency: tuple[float, float], damping: tuple[float, float], deviation: float, share: float, word: str
) -> None:
    misfit = DecayMisfit(time=np.array([0.0, 1.0]), share=np.array([0.0, share]), excess=np.ones(2))
    lines = [np.linspace(*ends, 12) for ends in (frequency, damping)]
    fault = find_fault(misfit, *lines, np.full(12, deviation))
    assert word in fault
    assert bool(fault) == bool(word)


@slow
def test_a_disturbed_decay_that_is_short_keeps_the_modes_that_were_read() -> None:
    """Nothing oscillates above the noise from a later start on, and the whole record was refused for it."""
    random = np.random.default_rng(1)
    places = np.linspace(0, 0.06, 6)
    wander = np.interp(TIME, places, [*(1.6 * random.standard_normal(5)), 0.0])
    signal = np.exp(-0.08 * 2 * np.pi * 50 * TIME) * np.cos(2 * np.pi * 50 * TIME + wander)
    modes = analyse_ring_down(TIME, signal + 0.02 * random.standard_normal(len(TIME)))
    assert min(abs(float(mode.frequency[-1]) / 50 - 1) for mode in modes) < 0.02


def test_what_a_fit_leaves_is_seen_at_the_phase_of_its_mode() -> None:
    """The record holds (1 + bump) of a mode: the share is the bump within Hann's average, and white noise none."""
    own = 2 * np.pi * FREQUENCY
    wave = np.exp(-DAMPING * own * TIME + 1j * own * np.sqrt(1 - DAMPING**2) * TIME)
    decay = find_decay(TIME, wave.real, 1 / 3200, 0.0, None, [FREQUENCY])
    fit = fit_slow_flows(decay.values, decay.step, guess_modes(decay, (), 0))
    noise = 1e-3 * np.random.default_rng(0).standard_normal(len(decay.values))
    quiet = measure_misfit(decay, replace(fit, residual=noise), 0)
    assert not quiet.share.any()
    # The mean of five averages of the power of white noise: beyond a factor of 3 once in 10^4.
    assert (quiet.excess < np.sqrt(3)).all()
    since = decay.step * np.arange(len(decay.values))
    bump = 0.05 * np.exp(-(((since - 0.5) / 0.15) ** 2))
    bumped = measure_misfit(decay, replace(fit, residual=bump * decay.values + noise), 0)
    top = int(np.argmax(bumped.share))
    # Within what the average over 74 ms takes off, (74 / 150)^2 / 10, and the noise.
    assert abs(bumped.share[top] - 0.05) < 0.004
    assert abs(bumped.time[top] - 0.5) < 0.04
    at = np.array([0.5, 1.5])
    np.testing.assert_allclose(
        quiet.widen(at, np.full(2, 1e-4)), 1e-4 * np.maximum(np.interp(at, quiet.time, quiet.excess), 1)
    )
    # A share of 5 % that comes within three periods turns the phase by as much over them: 0.05 / (6 pi).
    assert bumped.widen(at, np.zeros(2))[0] == pytest.approx(0.05 / (6 * np.pi), rel=0.1)


@slow
def test_the_start_that_is_proposed_gives_the_same_reading() -> None:
    signal = entangled_decay(0)
    first = analyse_ring_down(TIME, signal)
    (start,) = {float(text.split('start = "')[1].split(" s")[0]) for text in first[0].remarks if "start =" in text}
    again = analyse_ring_down(TIME, signal, start=start)
    assert [mode.start for mode in again] == [mode.start for mode in first]
    np.testing.assert_array_equal(again[0].frequency, first[0].frequency)


def test_a_mode_of_one_reading_has_splines() -> None:
    """It ended in a traceback of the splines: their range was empty."""
    decay = find_decay(
        TIME[:64], np.exp(-40 * TIME[:64]) * np.cos(2 * np.pi * 90 * TIME[:64]), 1 / 3200, 0.0, None, [90]
    )
    flow = guess_modes(decay, (), 3)[0]
    assert np.isfinite(flow.coefficients).all()
    assert (np.diff(flow.breaks) > 0).all()
