"""Campaigns drawn from a fitted model: what they scatter about, and by how much."""

from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.feature.observation import arrange_campaign, find_points
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.threshold.simulation import Simulation

DRAWS = 10


@pytest.fixture(scope="module")
def quiet(small: Model, paper: ModuleType) -> tuple[Campaign, Arrangement]:
    """Nothing differs between its repeats but noise."""
    campaign = paper.make_campaign(small, seed=3)
    return campaign, arrange(
        campaign,
        small,
        list_calibration_parameters(small, deviation={"kn": 0.0, "E": 0.0}),
        Budget(frequency=0.0, compliance=0.0, shares=0.0),
    )


def without_jitter(of: tuple[Campaign, Arrangement]) -> Simulation:
    campaign, arrangement = of
    return Simulation(campaign=campaign, arrangement=replace(arrangement, jitter=()))


def draws(simulation: Simulation) -> NDArray[np.complex128]:
    """Readings of so many draws, shape (DRAWS, rows)."""
    return np.array([simulation.draw(np.random.default_rng(seed)).measurement.value for seed in range(DRAWS)])


@pytest.fixture(scope="module")
def still(quiet: tuple[Campaign, Arrangement]) -> NDArray[np.complex128]:
    """Draws whose repeats do not differ in frequency."""
    return draws(without_jitter(quiet))


def test_rows_of_the_table_find_their_points(quiet: tuple[Campaign, Arrangement]) -> None:
    campaign, arrangement = quiet
    seen = arrange_campaign(campaign)
    rows = find_points(campaign, seen.points)
    column = np.unique(campaign.measurement.repeat, return_inverse=True)[1]
    np.testing.assert_array_equal(seen.repeat[rows, column], campaign.measurement.value)
    some = find_points(campaign, seen.points.where(seen.points.level == seen.points.level.min()))
    np.testing.assert_array_equal(some >= 0, campaign.measurement.level == seen.points.level.min())
    assert arrangement.train.observed.taken.any()


def test_a_free_structure_is_read_with_the_noise_that_was_measured(
    quiet: tuple[Campaign, Arrangement], still: NDArray[np.complex128], paper: ModuleType
) -> None:
    campaign, arrangement = quiet
    table = campaign.measurement
    free = np.array([test.configuration == "free" for test in campaign.tests])[table.test]
    expected = arrangement.held_out.predict(arrangement.fit.model)
    rows = find_points(campaign, expected.points)
    here = np.flatnonzero(free & (rows >= 0) & (table.repeat == 1))
    predicted, deviation = expected.value[rows[here]], paper.make_deviation(expected.points, expected.value)[rows[here]]
    apart = (still[:, here] - predicted) / deviation
    # The fit of a and b from four repeats of some dozens of points is good to a tenth or two.
    assert 0.75 < np.std(apart.real) < 1.3
    assert 0.75 < np.std(apart.imag) < 1.3
    # Means of so many draws, in units of their own standard deviation: 5 is out of reach for some hundred of them.
    assert np.abs(apart.mean(axis=0).real).max() * np.sqrt(DRAWS) < 5 * 1.3


def test_repeats_differ_by_a_shift_of_the_frequency_where_they_did(
    quiet: tuple[Campaign, Arrangement], still: NDArray[np.complex128]
) -> None:
    campaign, arrangement = quiet
    shift = [(effect, 3e-4 if effect.name.startswith("frequency") else 0.0) for effect, _ in arrangement.jitter]
    moved = Simulation(campaign=campaign, arrangement=replace(arrangement, jitter=tuple(shift)))
    table = campaign.measurement
    free = np.array([test.configuration == "free" for test in campaign.tests])[table.test] & (table.harmonic == 1)
    scatter = [np.std(np.abs(item[:, free]), axis=0) for item in (draws(moved), still)]
    # Away from the resonance a shift does nothing; at its flank it is most of what differs.
    assert (scatter[0] / scatter[1]).max() > 3
    assert np.median(scatter[0] / scatter[1]) > 1


def test_numerical_error_is_the_same_in_all_repeats(small: Model, quiet: tuple[Campaign, Arrangement]) -> None:
    campaign, arrangement = quiet
    simulation = Simulation(
        campaign=campaign, arrangement=replace(arrangement, jitter=(), budget=Budget(frequency=2e-3, compliance=0.0))
    )
    changes = []
    for seed in range(4):
        drawn = arrange_campaign(simulation.draw(np.random.default_rng(seed)))
        plain = arrange_campaign(without_jitter(quiet).draw(np.random.default_rng(seed)))
        free = drawn.points.free & (drawn.points.harmonic == 1)
        changes.append(np.abs(drawn.value[free] / plain.value[free] - 1).max())
    # On the flank where it matters most an error of 2e-3 changes a reading by several per cent.
    assert np.sqrt(np.mean(np.square(changes))) > 0.02
    spread = [np.nanstd(item.repeat[free], axis=1) / np.abs(item.value[free]) for item in (drawn, plain)]
    np.testing.assert_allclose(np.median(spread[0]), np.median(spread[1]), rtol=0.3)


def test_without_noise_repeats_differ_by_their_friction_histories_alone(quiet: tuple[Campaign, Arrangement]) -> None:
    campaign, arrangement = quiet
    sides = {
        name: replace(side, noise=0 * side.noise)
        for name, side in (("train", arrangement.train), ("held_out", arrangement.held_out))
    }
    simulation = Simulation(campaign=campaign, arrangement=replace(arrangement, jitter=(), **sides))
    drawn = arrange_campaign(simulation.draw(np.random.default_rng(4)))
    predicted = arrangement.train.predictor
    predicted = replace(predicted, points=drawn.points).predict(arrangement.fit.model)
    free = drawn.points.free
    np.testing.assert_allclose(drawn.repeat[free], np.repeat(predicted.value[free][:, None], 4, axis=1), rtol=1e-6)
    # What sticks keeps a force, which the mean normal force answers as flanks are inclined; all slip forgets it.
    static = ~free & (drawn.points.harmonic == 0)
    spread = np.ptp(drawn.repeat[static].real, axis=1) / np.abs(predicted.value[static])
    # A branch that a repeat is not on has no reading in it.
    assert 1e-3 < np.nanmax(spread) < 1
