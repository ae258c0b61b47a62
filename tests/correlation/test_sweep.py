"""Sweeps are followed point by point: each begins with the sliders where the last one left them."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from correlation.feature.observation import find_sweep_directions
from correlation.model import Model
from correlation.prediction import Points, Predictor
from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state

LEVEL = 3.0  # N: the contacts slip at some frequencies, and stick at others


@pytest.fixture(scope="module")
def points(small: Model, paper: ModuleType) -> Points:
    everything = paper.make_points(small)
    return everything.where(~everything.free & (everything.level == LEVEL))


def test_each_point_begins_where_the_last_one_left_the_sliders(small: Model, points: Points) -> None:
    prediction = Predictor(points=points, sweeps=(1, -1)).predict(small)
    balance = HarmonicBalance(system=small.system, n_harmonic=small.n_harmonic, n_sample=small.n_sample, level=LEVEL)
    slider, grid, tip = None, np.unique(points.frequency), {}
    for way in (1, -1):
        for frequency in grid[::way]:
            state = steady_state(balance, 2 * np.pi * frequency, slider=slider)
            slider = state.periodic_slider
            tip.setdefault(frequency, []).append(state.coefficients[1, 2])
    for frequency, (up, down) in tip.items():
        here = (points.frequency == frequency) & (points.sensor == "tip") & (points.harmonic == 1)
        # Newton's 1e-9 from other starts, in states that hand their sliders on.
        assert prediction.value[here][0] == pytest.approx((up + down) / 2, rel=1e-5)
        assert prediction.by_sweep[:, here].ravel() == pytest.approx([up, down], rel=1e-5)
    # It matters: without, each point begins at rest.
    rest = Predictor(points=points).predict(small)
    assert np.abs(prediction.value - rest.value).max() > 1e-4 * np.abs(rest.value).max()
    assert set(prediction.states_back) == set(prediction.states)


def test_where_nothing_slips_sweeps_change_nothing(small: Model, points: Points) -> None:
    low = replace(points, level=np.full(len(points), 1e-3), force=np.full(len(points), 1e-3))
    one, both = (Predictor(points=low, sweeps=sweeps).predict(small).value for sweeps in ((), (1, -1)))
    # Stuck contacts are linear: round-off beside the largest of newtons.
    np.testing.assert_allclose(both, one, rtol=0, atol=1e-8 * np.abs(one).max())


def test_the_free_structure_forgets(small: Model, paper: ModuleType) -> None:
    everything = paper.make_points(small)
    free = everything.where(everything.free)
    one, both = (Predictor(points=free, sweeps=sweeps).predict(small) for sweeps in ((), (1, -1)))
    np.testing.assert_array_equal(both.value, one.value)
    assert not both.states_back


def test_sweeps_are_those_of_the_jointed_structure_in_their_order(small: Model, paper: ModuleType) -> None:
    campaign = paper.make_campaign(small)
    table = campaign.measurement

    def swept(sweep: np.ndarray) -> tuple[int, ...]:
        return find_sweep_directions(replace(campaign, measurement=replace(table, sweep=sweep.astype(int))))

    late = table.order > table.order.max() // 2
    free = np.array([test.configuration == "free" for test in campaign.tests])[table.test]
    assert find_sweep_directions(campaign) == (1,)
    assert swept(np.where(late, -1, 1)) == (1, -1)
    assert swept(np.where(late, 1, -1)) == (-1, 1)
    assert swept(np.zeros(len(table))) == ()
    assert swept(np.where(free, -1, 1)) == (1,)
