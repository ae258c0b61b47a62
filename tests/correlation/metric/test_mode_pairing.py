"""Peaks of one mode: over levels, and of a measured and of a predicted structure."""

import numpy as np

from correlation.metric.curve_peak import CurvePeak
from correlation.metric.mode_pairing import OTHER_MODE, measure_distance, pair_modes, track_modes

FIRST, SECOND = (1.0, 0.8, 0.5), (-0.6, 0.4, 1.0)


def peak(frequency: float, shape: tuple[float, ...] = (1.0,)) -> CurvePeak:
    return CurvePeak(
        frequency=frequency, low=0.9 * frequency, high=1.1 * frequency, shape=np.array(shape, dtype=np.complex128)
    )


def list_frequencies(states: list[list[CurvePeak]]) -> list[dict[int, float]]:
    return [{number: peak.frequency for number, peak in sorted(mode.items())} for mode in track_modes(states)]


def test_the_distance_is_that_of_frequencies_and_shapes() -> None:
    assert measure_distance(peak(30.0), peak(60.0)) == 1.0
    turned = peak(30.0, tuple(-2j * np.array(FIRST)))  # type: ignore[arg-type]  # shapes are complex
    assert abs(measure_distance(peak(30.0, FIRST), turned)) < 1e-12  # a factor is none; round-off remains
    assert measure_distance(peak(30.0, (1.0, 0.0)), peak(30.0, (0.0, 1.0))) == OTHER_MODE
    # Sensors that one of both lacks do not count.
    assert measure_distance(peak(30.0, (1.0, np.nan)), peak(30.0, (1.0, 5.0))) == 0.0


def test_modes_are_tracked_through_levels_that_show_one_of_them() -> None:
    states = [[peak(30.0)], [peak(71.0)], [peak(29.0), peak(70.0)], [], [peak(66.0)]]
    assert list_frequencies(states) == [{0: 30.0, 2: 29.0}, {1: 71.0, 2: 70.0, 4: 66.0}]


def test_a_mode_may_change_by_far_over_many_levels() -> None:
    states = [[peak(frequency)] for frequency in (30.0, 25.0, 20.0, 16.0, 13.0)]
    assert len(list_frequencies(states)) == 1


def test_shapes_tell_modes_that_change_places() -> None:
    states = [[peak(30.0, FIRST), peak(31.0, SECOND)], [peak(30.0, SECOND), peak(31.0, FIRST)]]
    assert list_frequencies(states) == [{0: 30.0, 1: 31.0}, {0: 31.0, 1: 30.0}]


def test_a_stiff_model_is_paired_mode_by_mode() -> None:
    """Its first mode is nearer to the second of the measurements than to the first."""
    measured = track_modes([[peak(30.0), peak(33.0)]])
    assert pair_modes(measured, track_modes([[peak(32.0), peak(36.0)]])) == {0: 0, 1: 1}


def test_modes_an_octave_apart_or_at_other_levels_are_no_pair() -> None:
    measured = track_modes([[peak(30.0)], []])
    assert pair_modes(measured, track_modes([[peak(75.0)], []])) == {}
    assert pair_modes(measured, track_modes([[], [peak(30.0)]])) == {}
    assert pair_modes((), measured) == {}


def test_no_levels_have_no_modes() -> None:
    assert track_modes([]) == ()
