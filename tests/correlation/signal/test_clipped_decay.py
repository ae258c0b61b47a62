"""Clipped crests at the beginning of a free decay are found, and whole ones are not."""

import numpy as np
import pytest

from correlation.data_type.ring_down import FreeDecay
from correlation.signal.clipped_decay import describe_clipping
from correlation.signal.ring_down import analyse_ring_down

TIME = np.arange(4000) / 3200.0


def decay(seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    ring = np.exp(-12 * TIME) * np.cos(2 * np.pi * (80.0 + 20 * random.random()) * TIME + random.random())
    return np.round(20 * ring + 0.01 * random.standard_normal(len(TIME)), 4)


@pytest.mark.parametrize("seed", range(8))
def test_a_few_samples_of_the_first_crests_tell_a_range(seed: int) -> None:
    both = np.clip(decay(seed), -15, 15)
    assert (np.abs(both) == 15).mean() < 0.02  # of the whole record next to none
    assert f"{int((np.abs(both) == 15).sum())} samples" in describe_clipping(both)
    assert "upper and lower end" in describe_clipping(both)
    assert "lower end, -14, exactly" in describe_clipping(np.maximum(decay(seed), -14))


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("step", [1e-4, 0.05, 0.5])
def test_whole_crests_held_structures_and_coarse_converters_are_not_clipped(seed: int, step: float) -> None:
    held = np.concatenate([np.full(500, 21.0), decay(seed)])
    for values in (decay(seed), held):
        assert not describe_clipping(step * np.round(values / step))
    assert not describe_clipping(np.zeros(100))


def test_a_decay_that_is_read_behind_its_clipped_crests_says_so_and_one_that_is_read_with_them_is_suspected() -> None:
    signal = np.clip(decay(), -15, 15)
    for start, is_spoilt in ((None, False), (0.0, True)):
        modes = analyse_ring_down(TIME, signal, quantity="acceleration", start=start)
        result = FreeDecay(
            name="blow", configuration="jointed", sensor="a", modes=modes, unit="m/s^2", time=TIME, signal=signal
        )
        assert bool(result.suspicions) == is_spoilt
        assert any("clipped" in sentence for sentence in result.remarks) != is_spoilt
