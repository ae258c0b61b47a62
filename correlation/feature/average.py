"""Values that measure one point, averaged over repeats and sweeps, and what they scatter by."""

from dataclasses import dataclass, replace

import numpy as np

from correlation.campaign.measurement import SAME_FREQUENCY, ComplexColumn, FloatColumn, IntColumn, Mask, Measurement
from correlation.errors import CampaignError

POINT = ("test", "sensor", "harmonic", "level", "frequency")


@dataclass(frozen=True, kw_only=True, eq=False)
class Averages:
    """Some rows of a campaign, averaged at k points in s sweeps.

    Parameters
    ----------
    first
        A row of each point, k rows.
    point
        Its number among the points of the whole campaign, shape (k,).
    mean, n
        Over all values of a point, shape (k,).
    squares, dof
        Squared residuals about the mean of their sweep, and their degrees of freedom, shape (k,).
    effect
        Squares of the residuals summed over the sweeps of each repeat, shape (k,).
    sweep_point
        Point of each sweep, shape (s,).
    sweep_mean, sweep_n
        Over the values of each sweep, shape (s,).
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
    """All values of a point one after the other, sweep by sweep."""
    table = replace(measurement, frequency=_aligned(measurement.frequency))
    return table.where(np.lexsort([table.repeat, table.sweep, *(getattr(table, name) for name in reversed(POINT))]))


def average_points(measurement: Measurement, rows: Mask) -> Averages:
    """Average some rows of a table that `sort_by_point` has sorted.

    Raises
    ------
    CampaignError
        There are none.
    """
    table = measurement.where(rows)
    if not len(table):
        raise CampaignError("nothing was measured at these levels and repeats; choose among those of the campaign")
    starts = starts_of(table, POINT)
    n = np.diff([*starts, len(table)])
    point = np.repeat(np.arange(len(starts)), n)
    # About the mean of its sweep: what sweeps disagree by is no noise, and is told as `spread`.
    sweep_starts = starts_of(table, (*POINT, "sweep"))
    sweep_n = np.diff([*sweep_starts, len(table)])
    sweep_mean = _summed(table.value, sweep_starts) / sweep_n
    residual = table.value - np.repeat(sweep_mean, sweep_n)
    parts = np.where(table.harmonic[starts] == 0, 1, 2)  # a mean is real
    squares = _squares(point, residual)
    all_starts = starts_of(measurement, POINT)
    return Averages(
        first=table.where(starts),
        point=np.searchsorted(all_starts, np.flatnonzero(rows)[starts], side="right") - 1,
        mean=_summed(table.value, starts) / n,
        n=n,
        squares=squares,
        dof=(parts * (n - np.bincount(point[sweep_starts]))).astype(np.float64),
        effect=_repeat_effects(table, point, residual, squares),
        sweep_point=point[sweep_starts],
        sweep_mean=sweep_mean,
        sweep_n=sweep_n,
    )


def _aligned(frequency: FloatColumn) -> FloatColumn:
    """Frequencies that are the same but for rounding made equal, to the least of them."""
    rising, index = np.unique(frequency, return_inverse=True)
    first = np.concatenate([[True], np.diff(rising) > SAME_FREQUENCY * rising[1:]])
    aligned: FloatColumn = rising[first][np.cumsum(first) - 1][index]
    return aligned


def _repeat_effects(table: Measurement, point: IntColumn, residual: ComplexColumn, squares: FloatColumn) -> FloatColumn:
    """Squares of the residuals summed over the sweeps of each repeat, shape (k,)."""
    if not (table.sweep != table.sweep[0]).any():
        return squares
    order = np.lexsort((table.repeat, point))
    key = np.stack([point[order], table.repeat[order]])
    starts = np.flatnonzero(np.concatenate([[True], (key[:, 1:] != key[:, :-1]).any(axis=0)]))
    summed = _summed(residual[order], starts)
    return _squares(point[order][starts], summed)


def _summed(value: ComplexColumn, starts: IntColumn) -> ComplexColumn:
    """Sums of consecutive groups."""
    return np.asarray(np.add.reduceat(value, starts), dtype=np.complex128)


def _squares(point: IntColumn, value: ComplexColumn) -> FloatColumn:
    """Squared moduli summed over the rows of each point."""
    return np.bincount(point, value.real**2 + value.imag**2).astype(np.float64)


def starts_of(table: Measurement, names: tuple[str, ...]) -> IntColumn:
    """First row of each group of a sorted table."""
    new = np.zeros(len(table), dtype=bool)
    new[0] = True
    for name in names:
        column = getattr(table, name)
        new[1:] |= column[1:] != column[:-1]
    return np.flatnonzero(new)
