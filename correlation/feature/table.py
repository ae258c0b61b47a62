r"""Features: averages over repeats and sweeps at each point, with the noise of the mean.

The values of a point differ by instrument noise and by friction history, so that their scatter is partly proportional
to the amplitude, partly constant, and at some points much larger. For few repeats it is estimated in three steps:

1. their scatter :math:`s^2` is fitted, over all points of a test, sensor and harmonic, by
   :math:`a^2 |X|^2 + b^2`, robustly (`correlation.noise.variance`);
2. at each point the fit and the scatter of the point are averaged, weighted by their degrees of freedom;
3. sweeps of one repeat may have common errors: their correlation is estimated from all points, and the mean counts as
   an average over correspondingly fewer values.
"""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import (
    Campaign,
    ComplexColumn,
    FloatColumn,
    IntColumn,
    Mask,
    MeasuredSensor,
    Measurement,
    match_level,
)
from correlation.errors import CampaignError
from correlation.feature.reading_noise import LEAST_REPEATED, smooth_noise
from correlation.noise.variance import estimate_design_effect, pool_variance
from correlation.prediction import Points
from correlation.row_table import RowTable
from geometry.read_only_array import freeze_fields

POINT = ("test", "sensor", "harmonic", "level", "frequency")


@dataclass(frozen=True, kw_only=True, eq=False)
class Averages:
    """Some rows of a campaign, averaged at k points in s sweeps.

    Parameters
    ----------
    first
        A row of each point, k rows.
    point
        Index of each point among the points of the whole campaign, shape (k,).
    mean, n
        Mean and number of all values of a point, shape (k,).
    squares, dof
        Squared residuals about the mean of their sweep, and their degrees of freedom, shape (k,).
    effect
        Squares of the residuals summed over the sweeps of each repeat, shape (k,).
    sweep_point
        Point of each sweep, shape (s,).
    sweep_mean, sweep_n
        Mean and number of the values of each sweep, shape (s,).
    """

    first: Measurement
    point: IntColumn
    mean: ComplexColumn
    n: IntColumn
    squares: FloatColumn
    dof: FloatColumn
    effect: FloatColumn
    sweep_point: IntColumn
    sweep_mean: ComplexColumn
    sweep_n: IntColumn


def sort_by_point(measurement: Measurement) -> Measurement:
    """Table sorted such that the values of a point are consecutive, sweep by sweep."""
    order = [measurement.repeat, measurement.sweep, *(getattr(measurement, name) for name in reversed(POINT))]
    return measurement.where(np.lexsort(order))


def average_points(measurement: Measurement, rows: Mask) -> Averages:
    """Average some rows of a table that `sort_by_point` has sorted.

    Raises
    ------
    CampaignError
        There are no rows.
    """
    table = measurement.where(rows)
    if not len(table):
        raise CampaignError("nothing was measured at these levels and repeats; choose among those of the campaign")
    starts = find_starts(table, POINT)
    n = np.diff([*starts, len(table)])
    point = np.repeat(np.arange(len(starts)), n)
    # About the mean of its sweep: the difference between sweeps is not noise, and is reported as `spread`.
    sweep_starts = find_starts(table, (*POINT, "sweep"))
    sweep_n = np.diff([*sweep_starts, len(table)])
    sweep_mean = _sum_groups(table.value, sweep_starts) / sweep_n
    residual = table.value - np.repeat(sweep_mean, sweep_n)
    parts = np.where(table.harmonic[starts] == 0, 1, 2)  # a mean is real
    squares = _sum_squares(point, residual)
    all_starts = find_starts(measurement, POINT)
    return Averages(
        first=table.where(starts),
        point=np.searchsorted(all_starts, np.flatnonzero(rows)[starts], side="right") - 1,
        mean=_sum_groups(table.value, starts) / n,
        n=n,
        squares=squares,
        dof=(parts * (n - np.bincount(point[sweep_starts]))).astype(np.float64),
        effect=_repeat_effects(table, point, residual, squares),
        sweep_point=point[sweep_starts],
        sweep_mean=sweep_mean,
        sweep_n=sweep_n,
    )


def _repeat_effects(table: Measurement, point: IntColumn, residual: ComplexColumn, squares: FloatColumn) -> FloatColumn:
    """Squares of the residuals summed over the sweeps of each repeat, shape (k,)."""
    if not (table.sweep != table.sweep[0]).any():
        return squares
    order = np.lexsort((table.repeat, point))
    key = np.stack([point[order], table.repeat[order]])
    starts = np.flatnonzero(np.concatenate([[True], (key[:, 1:] != key[:, :-1]).any(axis=0)]))
    summed = _sum_groups(residual[order], starts)
    return _sum_squares(point[order][starts], summed)


def _sum_groups(value: ComplexColumn, starts: IntColumn) -> ComplexColumn:
    """Sums of consecutive groups."""
    return np.asarray(np.add.reduceat(value, starts), dtype=np.complex128)


def _sum_squares(point: IntColumn, value: ComplexColumn) -> FloatColumn:
    """Squared moduli summed over the rows of each point."""
    return np.bincount(point, value.real**2 + value.imag**2).astype(np.float64)


def find_starts(table: Measurement, names: tuple[str, ...]) -> IntColumn:
    """First row of each group of a sorted table."""
    new = np.zeros(len(table), dtype=bool)
    new[0] = True
    for name in names:
        column = getattr(table, name)
        new[1:] |= column[1:] != column[:-1]
    return np.flatnonzero(new)


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureTable(RowTable):
    """Means over repeats and sweeps, one per (test, level, frequency, sensor, harmonic).

    Parameters
    ----------
    test, level, frequency, sensor, harmonic
        As in `correlation.campaign.measurement.Measurement`, shape (k,).
    value
        Mean, shape (k,) [SI unit of the sensor].
    deviation
        Standard deviation of the real and of the imaginary part of the mean, shape (k,) [the same]; for harmonic 0,
        whose imaginary part is zero, of the real part.
    n
        Number of averaged values, shape (k,).
    spread
        Distance of the means of both sweeps, in its standard deviations, shape (k,) [-]: if the sweeps agree, 95 % are
        below 2.4; 0 with one sweep. A large value indicates a mean over two branches.
    """

    test: IntColumn
    level: FloatColumn
    frequency: FloatColumn
    sensor: IntColumn
    harmonic: IntColumn
    value: ComplexColumn
    deviation: FloatColumn
    n: IntColumn
    spread: FloatColumn

    def __post_init__(self) -> None:
        freeze_fields(self, "test", "sensor", "harmonic", "n", kind=np.int64)
        freeze_fields(self, "level", "frequency", "deviation", "spread")
        freeze_fields(self, "value", kind=np.complex128)

    def common_rows(self, first: int, second: int, harmonic: int) -> tuple[IntColumn, IntColumn]:
        """Rows of two sensors at the same tests, levels and frequencies, of one harmonic, shape (n,) each."""
        rows = [np.flatnonzero((self.sensor == sensor) & (self.harmonic == harmonic)) for sensor in (first, second)]
        states = np.column_stack([self.test, self.level, self.frequency]).tolist()
        of_state = [{tuple(states[row]): row for row in item.tolist()} for item in rows]
        common = [state for state in of_state[0] if state in of_state[1]]
        return np.array([of_state[0][s] for s in common], int), np.array([of_state[1][s] for s in common], int)


def average_campaign(campaign: Campaign) -> FeatureTable:
    """Means of all points of a campaign; their deviations are NaN where the noise is unknown."""
    measurement = sort_by_point(campaign.measurement)
    average = average_points(measurement, np.ones(len(measurement), dtype=bool))
    return _make_table(average, *_estimate_noise(campaign, average))


def extract_features(
    campaign: Campaign, *, levels: Collection[float] | None = None, repeats: Collection[int] | None = None
) -> FeatureTable:
    """Average a campaign, or some levels [N] and repeats of it.

    Raises
    ------
    CampaignError
        There are no such measurements, or no point was repeated, so that the noise is unknown.
    """
    measurement = sort_by_point(campaign.measurement)
    rows = np.ones(len(measurement), dtype=bool)
    if repeats is not None:
        rows &= np.isin(measurement.repeat, list(repeats))
    if levels is not None:
        rows &= np.any([match_level(measurement.level, level) for level in levels] or [~rows], axis=0)
    chosen = average_points(measurement, rows)
    return _make_table(chosen, *_estimate_known_noise(campaign, chosen))


def split(campaign: Campaign) -> tuple[FeatureTable, FeatureTable]:
    """Features to train on, and features held out.

    No value is in both: held out are the held-out levels (all repeats) and the held-out repeats of the other levels,
    the rest is for training. The noise of training data is estimated from these alone; that of held-out data, often of
    two repeats, from the whole campaign.

    Raises
    ------
    CampaignError
        Nothing is held out, everything is, or training has no repeats.
    """
    if not campaign.held_out.levels and not campaign.held_out.repeats:
        raise CampaignError("the campaign holds out nothing; add [held_out] with levels or repeats to its manifest")
    measurement = sort_by_point(campaign.measurement)
    held = campaign.held_out.rows(measurement)
    training, tested, everything = (average_points(measurement, rows) for rows in (~held, held, np.ones_like(held)))
    variance, together = (item[tested.point] for item in _estimate_known_noise(campaign, everything))
    return _make_table(training, *_estimate_known_noise(campaign, training)), _make_table(tested, variance, together)


def _make_table(average: Averages, variance: FloatColumn, together: FloatColumn) -> FeatureTable:
    return FeatureTable(
        **{name: getattr(average.first, name) for name in POINT},
        value=average.mean,
        deviation=np.sqrt(variance / average.n * np.minimum(together, average.n)),
        n=average.n,
        spread=_spread(average.sweep_point, average.sweep_mean, average.sweep_n, variance),
    )


def _estimate_known_noise(campaign: Campaign, average: Averages) -> tuple[FloatColumn, FloatColumn]:
    """As `_estimate_noise`; unknown noise is an error."""
    variance, together = _estimate_noise(campaign, average)
    unknown = np.flatnonzero(~np.isfinite(variance))
    if len(unknown):
        row, first = unknown[0], average.first
        test, sensor = campaign.tests[first.test[row]].name, campaign.sensors[first.sensor[row]].name
        raise CampaignError(
            f'test "{test}", sensor "{sensor}": no point was measured twice in one sweep, so its noise is '
            "not known; measure repeats, or hold out fewer"
        )
    return variance, together


def _estimate_noise(campaign: Campaign, average: Averages) -> tuple[FloatColumn, FloatColumn]:
    """Variance of one value, NaN where unknown, and number of values that count as one, per point, shape (k,) each."""
    first, dof, squares = average.first, average.dof, average.squares
    variance, together = np.full(len(first), np.nan), np.ones(len(first))
    blocks = find_starts(first, ("test", "sensor", "harmonic"))
    for start, stop in zip(blocks, [*blocks[1:], len(first)], strict=True):
        block = slice(start, stop)
        n_repeated = np.count_nonzero(dof[block])
        if n_repeated < LEAST_REPEATED * (stop - start):
            sensor_of = campaign.sensors[first.sensor[start]]
            single = _estimate_single_noise(sensor_of, first.where(np.arange(start, stop)), average.mean[block])
            if not n_repeated or np.isfinite(single).all():
                variance[block] = single**2
                continue
        together[block] = estimate_design_effect(average.effect[block], squares[block], dof[block])
        # Errors with a correlation rho have fewer degrees of freedom: by the factor 1 + rho^2 for pairs.
        certain = dof[block] / (1 + (together[block] - 1) ** 2)
        scatter = squares[block] / np.maximum(dof[block], 1.0)
        variance[block] = pool_variance(np.abs(average.mean[block]), scatter, certain)
    return variance, together


def _estimate_single_noise(sensor: MeasuredSensor, rows: Measurement, mean: ComplexColumn) -> FloatColumn:
    """Noise of a block that was read once, stated or estimated from its curves, shape (k,); NaN if unknown."""
    if any(sensor.noise):
        return np.asarray(np.hypot(sensor.noise[0] * np.abs(mean), sensor.noise[1]))
    points = Points(
        free=np.zeros(len(rows), dtype=np.bool_), level=rows.level, frequency=rows.frequency,
        sensor=np.full(len(rows), sensor.name), harmonic=rows.harmonic,
    )  # fmt: skip
    return smooth_noise(points, mean, has_phase=sensor.has_phase)


def _spread(
    point: IntColumn,
    mean: ComplexColumn,
    n: IntColumn,
    variance: FloatColumn,
) -> FloatColumn:
    """Distance of the first and the last sweep of each point, in standard deviations of one part, shape (k,)."""
    first = np.searchsorted(point, np.arange(len(variance)), side="left")
    last = np.searchsorted(point, np.arange(len(variance)), side="right") - 1
    deviation = np.sqrt(variance * (1 / n[first] + 1 / n[last]))
    spread: Float[NDArray[np.float64], " k"] = np.where(
        first == last, 0.0, np.abs(mean[last] - mean[first]) / deviation
    )
    return spread
