"""Decays whose beginning no function of the amplitude describes, before a part in closed form."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.decay_misfit import Misfit, find_fault
from correlation.signal.release import find_decay, first_guess
from correlation.signal.ring_down import analyse_ring_down
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
    mode = min(modes, key=lambda each: abs(float(each.frequency[-1]) - FREQUENCY))
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
    misfit = Misfit(time=np.array([0.0, 1.0]), share=np.array([0.0, share]), excess=np.ones(2))
    lines = [np.linspace(*ends, 12) for ends in (frequency, damping)]
    fault = find_fault(misfit, *lines, np.full(12, deviation))
    assert word in fault
    assert bool(fault) == bool(word)


def test_a_mode_of_one_reading_has_splines() -> None:
    """It ended in a traceback of the splines: their range was empty."""
    decay = find_decay(
        TIME[:64], np.exp(-40 * TIME[:64]) * np.cos(2 * np.pi * 90 * TIME[:64]), 1 / 3200, 0.0, None, [90]
    )
    flow = first_guess(decay, (), 3)[0]
    assert np.isfinite(flow.coefficients).all()
    assert (np.diff(flow.breaks) > 0).all()
