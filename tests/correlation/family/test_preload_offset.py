"""Set-ups that are pressed a little more or less than the model, against limits that follow the preload."""

import numpy as np
import pytest

from correlation.family.band import LimitChange, PredictedBand
from correlation.family.correction import correct_family
from correlation.family.family import Family, FamilyCurve
from correlation.family.noise import ReadingNoise
from correlation.family.preload_offset import PRELOAD_SPAN, estimate_preload_offsets
from correlation.family.verdict import judge_family

FREQUENCY = np.linspace(20.0, 22.0, 21)
#: Power of each preload that an amplitude falls with: the first one where contacts slip at resonance, the other beyond.
POWERS = np.array([4.0 * np.exp(-((FREQUENCY - 20.5) ** 2) / 0.1), 3.0 * np.exp(-((FREQUENCY - 21.5) ** 2) / 0.1)])
LIMIT = 1 + 0.1 * (FREQUENCY - 21)
NOISE = ReadingNoise(relative=0.003, source="stated")


def limits(preload: np.ndarray) -> np.ndarray:
    return np.array([0.99, 1.01])[:, None] * LIMIT * np.exp(-(preload @ POWERS))


def change(group: int) -> LimitChange:
    moved = PRELOAD_SPAN * np.eye(2)[group]
    steps = (-1.0, -0.5, 0.5, 1.0)
    return LimitChange(PRELOAD_SPAN * np.array(steps), np.array([limits(step * moved) for step in steps]))


BAND = PredictedBand(
    frequency=FREQUENCY, value=limits(np.zeros(2)), deviation=np.zeros((2, 21)), jump=np.zeros((2, 21), dtype=bool),
    by_preload=(change(0), change(1)),
)  # fmt: skip


def family(preloads: list[np.ndarray]) -> Family:
    random = np.random.default_rng(11)
    curves = []
    for repeat, preload in enumerate(preloads, start=1):
        low, high = limits(preload)
        value = (low + (high - low) * random.uniform(0, 1, 21)) * (1 + 0.003 * random.standard_normal(21))
        curves.append(FamilyCurve(test="t", repeat=repeat, sweep=1, frequency=FREQUENCY, value=value))
    return Family(sensor="tip", harmonic=1, level=1.0, curves=tuple(curves))


def leaves(preloads: list[np.ndarray], corrected: bool) -> bool:
    own = family(preloads)
    if corrected:
        own = correct_family(own, BAND, estimate_preload_offsets([own], [BAND], [NOISE], set_up=0.0, model=0.0))
    return judge_family(own, BAND, NOISE, shift=0.0, n_reading=own.n_point).leaves_band


def test_preloads_of_set_ups_are_told_by_where_readings_leave_the_limits() -> None:
    truth = [np.array([-0.02, 0.0]), np.array([0.01, 0.02])]
    result = estimate_preload_offsets([family(truth)], [BAND], [NOISE], set_up=0.0, model=0.0)
    for repeat, expected in enumerate(truth, start=1):
        # A band of 2 % hides 0.5 % of preload to either side, where it changes amplitudes by the fourth power.
        np.testing.assert_allclose(result["t", repeat], expected, atol=0.0075)
    assert leaves(truth, corrected=False)
    assert not leaves(truth, corrected=True)


@pytest.mark.parametrize("group", [0, 1])
def test_a_preload_that_is_far_off_is_no_difference_between_set_ups(group: int) -> None:
    assert leaves([-0.15 * np.eye(2)[group], np.zeros(2)], corrected=True)


def test_without_contacts_that_tell_nothing_is_moved() -> None:
    bare = PredictedBand(frequency=FREQUENCY, value=BAND.value, deviation=BAND.deviation, jump=BAND.jump)
    own = family([np.array([-0.02, 0.0])])
    result = estimate_preload_offsets([own], [bare], [NOISE], set_up=0.0, model=0.0)
    assert not result["t", 1].size
    assert correct_family(own, bare, result) is own
