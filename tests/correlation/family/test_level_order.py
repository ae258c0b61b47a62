"""A level comes after others as the runs were made, each repeat by itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.family.level_order import find_earlier_levels

UP, ALL = np.tri(3, dtype=bool), np.ones((3, 3), dtype=bool)


def campaign(levels: list[float], repeats: list[int], order: list[int] | None = None) -> Campaign:
    n = len(levels)
    return Campaign(
        title="runs", folder=Path(),
        sensors=(MeasuredSensor(name="tip", quantity="displacement", direction="z", place="tip"),),
        tests=(Test(name="stepped"),),
        measurement=Measurement(
            test=np.zeros(n), order=np.arange(n) if order is None else order, repeat=repeats, sweep=np.ones(n),
            level=levels, frequency=100 + np.arange(n), sensor=np.zeros(n), harmonic=np.ones(n),
            value=np.ones(n, dtype=complex),
        ),
        held_out=HeldOut(),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("levels", "expected"),
    [
        ([1, 1, 3, 3, 10], UP),
        ([10, 3, 3, 1], UP.T),
        # At each frequency all levels: each but the first run of the test comes after all others.
        ([1, 3, 10, 1, 3, 10], ALL),
        ([3, 1, 10, 1], np.array([[1, 1, 1], [0, 1, 0], [1, 1, 1]])),
    ],
)
def test_levels_count_from_when_they_were_first_measured(levels: list[float], expected: np.ndarray) -> None:
    result = find_earlier_levels(campaign(levels, [1] * len(levels)), [1.0, 3.0, 10.0])
    np.testing.assert_array_equal(result, expected)


def test_a_repeat_begins_anew_and_one_that_differs_counts_for_all() -> None:
    ascending = campaign([1, 3, 10, 1, 3, 10], [1, 1, 1, 2, 2, 2])
    np.testing.assert_array_equal(find_earlier_levels(ascending, [1.0, 3.0, 10.0]), UP)
    one_descends = campaign([1, 3, 10, 10, 3, 1], [1, 1, 1, 2, 2, 2])
    np.testing.assert_array_equal(find_earlier_levels(one_descends, [1.0, 3.0, 10.0]), ALL)


def test_runs_of_unknown_order_may_have_come_in_any() -> None:
    unknown = campaign([1, 3, 10], [1, 1, 1], order=[0, 0, 0])
    np.testing.assert_array_equal(find_earlier_levels(unknown, [1.0, 3.0, 10.0]), ALL)


def test_tests_without_contacts_drag_nothing() -> None:
    free = replace(campaign([10, 3, 1], [1, 1, 1]), tests=(Test(name="stepped", configuration="free"),))
    np.testing.assert_array_equal(find_earlier_levels(free, [1.0, 3.0, 10.0]), np.eye(3, dtype=bool))
