r"""Features: what repeats and sweeps measured at one point, averaged, with the noise of the mean.

The values of a point differ by noise of the instruments and by the history of the friction, so their scatter is partly
proportional to the amplitude, partly constant, and here and there much larger. Three steps make the best of few
repeats:

1. their scatter :math:`s^2` is fitted, over all points of a test, sensor and harmonic, by
   :math:`a^2 |X|^2 + b^2`, robustly (`correlation.noise`);
2. at each point the fit and the point's own scatter are averaged, weighted by their degrees of freedom;
3. sweeps of one repeat may err together: by how much is seen in all points together, and the mean counts as an
   average over fewer values accordingly.
"""

from collections.abc import Collection
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.measurement import (
    Campaign,
    ComplexColumn,
    FloatColumn,
    IntColumn,
    Mask,
    Measurement,
    lock_columns,
    same_level,
)
from correlation.noise import design_effect, pooled_variance

#: Frequencies that differ by less than this share are one: counters and files round.
SAME_FREQUENCY = 1e-5
_POINT = ("test", "sensor", "harmonic", "level", "frequency")


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureTable:
    """Means over repeats and sweeps, one a (test, level, frequency, sensor, harmonic).

    Parameters
    ----------
    test, level, frequency, sensor, harmonic
        As in `correlation.measurement.Measurement`, shape (k,).
    value
        Mean, shape (k,) [SI unit of the sensor].
    deviation
        Standard deviation of the mean, of its real and of its imaginary part alike, shape (k,) [the same]; of harmonic
        0, whose imaginary part is zero, of the real part.
    n
        Number of values averaged, shape (k,).
    spread
        Distance of the means of both sweeps, in its standard deviations, shape (k,) [-]: where the sweeps agree, 95 %
        are below 2.4; 0 where there is one sweep. A large one says that the mean is one of two branches.
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
        lock_columns(self, float_columns=("level", "frequency", "deviation", "spread"), complex_columns=("value",))

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.value)

    def where(self, rows: Mask | IntColumn) -> "FeatureTable":
        """Some of the rows, by a mask or by their numbers."""
        return replace(self, **{each.name: getattr(self, each.name)[rows] for each in fields(self)})


def features(
    campaign: Campaign, *, levels: Collection[float] | None = None, repeats: Collection[int] | None = None
) -> FeatureTable:
    """Average a campaign, or some levels [N] and repeats of it.

    Raises
    ------
    CampaignError
        Nothing was measured there, or no point was repeated, so that the noise is not known.
    """
    measurement = campaign.measurement
    rows = np.ones(len(measurement), dtype=bool)
    if repeats is not None:
        rows &= np.isin(measurement.repeat, list(repeats))
    if levels is not None:
        rows &= np.any([same_level(measurement.level, level) for level in levels] or [~rows], axis=0)
    return averaged(campaign, rows)


def split(campaign: Campaign) -> tuple[FeatureTable, FeatureTable]:
    """Features to train on, and features held out.

    No value is in both: training has the other levels and the other repeats; held out are the held-out levels (all
    repeats) and the held-out repeats of the other levels. Each has the noise of its own scatter.

    Raises
    ------
    CampaignError
        Nothing is held out, or a half has too few repeats.
    """
    if not campaign.held_out.levels and not campaign.held_out.repeats:
        raise CampaignError("the campaign holds out nothing; add [held_out] with levels or repeats to its manifest")
    held = campaign.held_out.rows(campaign.measurement)
    return averaged(campaign, ~held), averaged(campaign, held)


def averaged(campaign: Campaign, rows: Bool[NDArray[np.bool_], " k"]) -> FeatureTable:
    """Average some rows of a campaign.

    Raises
    ------
    CampaignError
        There are none, or no point was repeated.
    """
    table = campaign.measurement.where(rows)
    if not len(table):
        raise CampaignError("nothing was measured at these levels and repeats; choose among those of the campaign")
    table = replace(table, frequency=_aligned(table.frequency))
    table = table.where(np.lexsort([table.repeat, table.sweep, *(getattr(table, name) for name in reversed(_POINT))]))
    starts = _starts(table, _POINT)
    n = np.diff([*starts, len(table)])
    mean = _summed(table.value, starts) / n
    point = np.repeat(np.arange(len(starts)), n)
    # About the mean of its sweep: what sweeps disagree by is no noise, and is told as `spread`.
    sweep_starts = _starts(table, (*_POINT, "sweep"))
    n_sweep = np.diff([*sweep_starts, len(table)])
    sweep_mean = _summed(table.value, sweep_starts) / n_sweep
    residual = table.value - np.repeat(sweep_mean, n_sweep)
    parts = np.where(table.harmonic[starts] == 0, 1, 2)  # a mean is real
    dof = (parts * (n - np.bincount(point[sweep_starts]))).astype(np.float64)
    squares = _squares(point, residual)
    effect = _repeat_effects(table, point, residual, squares)
    variance, together = _noise(campaign, table.where(starts), mean, squares, dof, effect)
    return FeatureTable(
        **{name: getattr(table, name)[starts] for name in _POINT},
        value=mean,
        deviation=np.sqrt(variance / n * np.minimum(together, n)),
        n=n,
        spread=_spread(point[sweep_starts], sweep_mean, n_sweep, variance),
    )


def _aligned(frequency: FloatColumn) -> FloatColumn:
    """Frequencies that are the same but for rounding made equal, to the least of them."""
    rising, index = np.unique(frequency, return_inverse=True)
    first = np.concatenate([[True], np.diff(rising) > SAME_FREQUENCY * rising[1:]])
    aligned: FloatColumn = rising[first][np.cumsum(first) - 1][index]
    return aligned


def _noise(
    campaign: Campaign,
    first: Measurement,
    mean: ComplexColumn,
    squares: FloatColumn,
    dof: FloatColumn,
    effect: FloatColumn,
) -> tuple[FloatColumn, FloatColumn]:
    """Variance of one value, and how many values count as one, at every point, shape (k,) each."""
    variance, together = np.full(len(mean), np.nan), np.ones(len(mean))
    blocks = _starts(first, ("test", "sensor", "harmonic"))
    for start, stop in zip(blocks, [*blocks[1:], len(mean)], strict=True):
        block = slice(start, stop)
        if not dof[block].any():
            test, sensor = campaign.tests[first.test[start]].name, campaign.sensors[first.sensor[start]].name
            raise CampaignError(
                f'test "{test}", sensor "{sensor}": no point was measured twice in one sweep, so its noise is '
                "not known; measure repeats, or hold out fewer"
            )
        together[block] = design_effect(effect[block], squares[block], dof[block])
        # Values that err together with a correlation rho tell less of their variance: by 1 + rho^2 for pairs.
        certain = dof[block] / (1 + (together[block] - 1) ** 2)
        scatter = squares[block] / np.maximum(dof[block], 1.0)
        variance[block] = pooled_variance(np.abs(mean[block]), scatter, certain)
    return variance, together


def _repeat_effects(table: Measurement, point: IntColumn, residual: ComplexColumn, squares: FloatColumn) -> FloatColumn:
    """Squares of the residuals summed over the sweeps of each repeat, shape (k,)."""
    if not (table.sweep != table.sweep[0]).any():
        return squares
    order = np.lexsort((table.repeat, point))
    key = np.stack([point[order], table.repeat[order]])
    starts = np.flatnonzero(np.concatenate([[True], (key[:, 1:] != key[:, :-1]).any(axis=0)]))
    summed = _summed(residual[order], starts)
    return _squares(point[order][starts], summed)


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


def _summed(value: ComplexColumn, starts: IntColumn) -> ComplexColumn:
    """Sums of consecutive groups."""
    return np.asarray(np.add.reduceat(value, starts), dtype=np.complex128)


def _squares(point: IntColumn, value: ComplexColumn) -> FloatColumn:
    """Squared moduli summed over the rows of each point."""
    return np.bincount(point, value.real**2 + value.imag**2).astype(np.float64)


def _starts(table: Measurement, names: tuple[str, ...]) -> IntColumn:
    """First row of each group of a sorted table."""
    new = np.zeros(len(table), dtype=bool)
    new[0] = True
    for name in names:
        column = getattr(table, name)
        new[1:] |= column[1:] != column[:-1]
    return np.flatnonzero(new)
