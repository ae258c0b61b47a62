"""Jumps of measured and predicted sweeps: their frequencies are compared, and not the branches between them."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.random_oscillators import Oscillator
from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.jump_error import compute_jump_errors, find_rows_between_jumps, take_measured_branch
from correlation.metric.peak_error import PeakSource, compute_peak_errors
from correlation.noise.covariance import Whitening
from correlation.prediction import Points, Prediction, SweepJump

DUFFING = Oscillator(kind="hardening", frequency=50.0, damping=0.005, strength=0.05)
FORCE = 0.01 * (2 * np.pi * 50.0) ** 2
GRID = np.linspace(48, 54, 121)


def observed(sweeps: tuple[int, ...]) -> Observation:
    """Both sweeps as one row where they agree and as two where they do not; or one sweep."""
    both = {way: DUFFING.sweep(FORCE, GRID, way) for way in (1, -1)}
    split = np.abs(both[1] - both[-1]) > 0.05 * np.abs(both[1]) if len(sweeps) == 2 else np.zeros(len(GRID), dtype=bool)
    rows = [(f, way, both[way][n]) for n, f in enumerate(GRID) for way in (sweeps if split[n] else (0,)) if way]
    rows += [(f, 0, both[sweeps[0]][n]) for n, f in enumerate(GRID) if not split[n]]
    return arrange(rows)


def arrange(rows: list[tuple[float, int, complex]]) -> Observation:
    """Rows of frequency, sweep and value."""
    frequency, sweep, value = (np.array(column) for column in zip(*rows, strict=True))
    k = len(rows)
    points = Points(
        free=np.zeros(k, dtype=bool), level=np.full(k, 3.0), frequency=frequency, sensor=np.full(k, "tip"),
        harmonic=np.ones(k, dtype=int), sweep=sweep.astype(int),
    )  # fmt: skip
    ones = np.ones((k, 1), dtype=bool)
    return Observation(points=points, repeat=value[:, None], motion=ones[:, 0], taken=ones)


def prediction(of: Observation, *jumps: SweepJump) -> Prediction:
    return Prediction(points=of.points, value=of.value, states={}, jumps=jumps)


@pytest.mark.parametrize("sweeps", [(1, -1), (1,), (-1,)])
def test_measured_jumps_lie_where_the_sweeps_leave_their_branches(sweeps: tuple[int, ...]) -> None:
    of = observed(sweeps)
    errors = compute_jump_errors(of, prediction(of), sweeps)
    assert len(errors) == len(sweeps)
    for item in errors:
        curve = np.abs(DUFFING.sweep(FORCE, GRID, item.sweep))
        step = int(np.argmax(np.abs(np.diff(curve))))
        assert item.frequency == pytest.approx(GRID[step : step + 2].mean(), abs=1e-9)
        assert item.falls == (item.sweep == 1)
        assert np.isnan(item.predicted_frequency)
        assert item.swept_both_ways == (len(sweeps) == 2)


def test_measured_jumps_are_found_where_the_sweeps_were_read_at_other_frequencies() -> None:
    grids = {1: GRID, -1: GRID + 0.4 * (GRID[1] - GRID[0])}
    rows = [(f, way, v) for way, at in grids.items() for f, v in zip(at, DUFFING.sweep(FORCE, at, way), strict=True)]
    of = arrange(rows)
    errors = compute_jump_errors(of, prediction(of), (1, -1))
    assert [(item.sweep, item.falls) for item in errors] == [(1, True), (-1, False)]
    for item in errors:
        curve = np.abs(DUFFING.sweep(FORCE, grids[item.sweep], item.sweep))
        step = int(np.argmax(np.abs(np.diff(curve))))
        assert item.frequency == pytest.approx(grids[item.sweep][step : step + 2].mean(), abs=1e-9)


def test_points_between_a_measured_and_a_predicted_jump_are_found() -> None:
    of = observed((1, -1))
    (up, down) = compute_jump_errors(of, prediction(of), (1, -1))
    model = (
        SweepJump(False, 3.0, 1, up.frequency - 0.4, True),
        SweepJump(False, 3.0, -1, down.frequency - 0.2, False),
        SweepJump(False, 3.0, 1, 49.0, False),
    )
    errors = compute_jump_errors(of, prediction(of, *model), (1, -1))
    matched = [item for item in errors if np.isfinite(item.frequency_error)]
    assert [round(item.frequency_error, 9) for item in matched] == [-0.4, -0.2]
    # What the model alone has is an error as well.
    assert [item.predicted_frequency for item in errors if np.isnan(item.frequency)] == [49.0]
    between, points = find_rows_between_jumps(of, errors), of.points
    above = (points.frequency > up.frequency - 0.4) & (points.frequency < up.frequency)
    below = (points.frequency > down.frequency - 0.2) & (points.frequency < down.frequency)
    expected = (above & (points.sweep != -1)) | (below & (points.sweep != 1))
    np.testing.assert_array_equal(between, expected)


def test_a_jump_at_a_level_that_is_not_among_the_data_is_none_that_they_lack() -> None:
    """The way to a level leads through those that are held out."""
    of = observed((1, -1))
    model = SweepJump(False, 5.0, 1, 49.0, True), SweepJump(True, 3.0, 1, 49.0, True)
    assert compute_jump_errors(of, prediction(of, *model), (1, -1)) == compute_jump_errors(of, prediction(of), (1, -1))


@pytest.mark.parametrize("sweeps", [(1, -1), (1,)])
@pytest.mark.parametrize("error", [-0.4, 0.4])
def test_between_two_jumps_the_model_is_read_on_the_branch_of_the_structure(
    sweeps: tuple[int, ...], error: float
) -> None:
    """The upper branch of the model ends later than the structure leaves it, or earlier."""
    of = observed(sweeps)
    up = next(item for item in compute_jump_errors(of, prediction(of), sweeps) if item.sweep == 1)
    end, frequency = up.frequency + error, of.points.frequency
    below = DUFFING.sweep(FORCE, frequency, -1)
    upper = np.where(frequency < up.frequency, DUFFING.sweep(FORCE, frequency, 1), 5 * below)
    first = np.where(frequency > end, below, upper)
    by_sweep = np.stack([first, below][: len(sweeps)])
    swept = np.where(of.points.sweep == 0, by_sweep.mean(axis=0), np.where(of.points.sweep == 1, first, below))
    model = replace(prediction(of, SweepJump(False, 3.0, 1, end, True)), value=swept, by_sweep=by_sweep)
    value = take_measured_branch(of, model, sweeps)
    between = find_rows_between_jumps(of, compute_jump_errors(of, model, sweeps))
    assert between.sum() > 3
    np.testing.assert_array_equal(value[~between], swept[~between])
    if error > 0 and len(sweeps) == 2:
        np.testing.assert_array_equal(value[between], below[between])
    else:
        at = frequency[frequency > end].min() if error > 0 else frequency[frequency < end].max()
        assert (value[between] == first[frequency == at][0]).all()


@pytest.mark.parametrize("sweeps", [(1, -1), (1,), (-1,)])
def test_a_branch_is_not_read_as_damping(sweeps: tuple[int, ...]) -> None:
    of = observed(sweeps)
    features = FeatureVector.choose(of.points, of.value, of.motion)
    whitening = Whitening(deviation=1e-6 * np.abs(features.of_values(of.value)))
    source = PeakSource(observed=of, predicted=of.value, features=features, whitening=whitening, sweeps=sweeps)
    result = compute_peak_errors([source])
    assert result.errors == ()
    (reason,) = result.unread
    assert "3 N" in reason
    assert "jump" in reason
