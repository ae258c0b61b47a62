r"""Features: what repeats and sweeps measured at one point, averaged, with the noise of the mean.

The values of a point differ by noise of the instruments and by the history of the friction, so their scatter is partly
proportional to the amplitude, partly constant, and here and there much larger. Three steps make the best of few
repeats:

1. their scatter :math:`s^2` is fitted, over all points of a test, sensor and harmonic, by
   :math:`a^2 |X|^2 + b^2`, robustly (`correlation.noise.variance`);
2. at each point the fit and the point's own scatter are averaged, weighted by their degrees of freedom;
3. sweeps of one repeat may err together: by how much is seen in all points together, and the mean counts as an
   average over fewer values accordingly.
"""

from collections.abc import Collection
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import (
    Campaign,
    ComplexColumn,
    FloatColumn,
    IntColumn,
    Mask,
    same_level,
)
from correlation.errors import CampaignError
from correlation.feature.average import POINT, Averages, average_points, sort_by_point, starts_of
from correlation.noise.variance import estimate_design_effect, pool_variance


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureTable:
    """Means over repeats and sweeps, one a (test, level, frequency, sensor, harmonic).

    Parameters
    ----------
    test, level, frequency, sensor, harmonic
        As in `correlation.campaign.measurement.Measurement`, shape (k,).
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
        freeze_fields(self, "test", "sensor", "harmonic", "n", kind=np.int64)
        freeze_fields(self, "level", "frequency", "deviation", "spread")
        freeze_fields(self, "value", kind=np.complex128)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.value)

    def where(self, rows: Mask | IntColumn) -> "FeatureTable":
        """Some of the rows, by a mask or by their numbers."""
        return replace(self, **{each.name: getattr(self, each.name)[rows] for each in fields(self)})


def extract_features(
    campaign: Campaign, *, levels: Collection[float] | None = None, repeats: Collection[int] | None = None
) -> FeatureTable:
    """Average a campaign, or some levels [N] and repeats of it.

    Raises
    ------
    CampaignError
        Nothing was measured there, or no point was repeated, so that the noise is not known.
    """
    measurement = sort_by_point(campaign.measurement)
    rows = np.ones(len(measurement), dtype=bool)
    if repeats is not None:
        rows &= np.isin(measurement.repeat, list(repeats))
    if levels is not None:
        rows &= np.any([same_level(measurement.level, level) for level in levels] or [~rows], axis=0)
    chosen = average_points(measurement, rows)
    return _table(chosen, *_noise(campaign, chosen))


def split(campaign: Campaign) -> tuple[FeatureTable, FeatureTable]:
    """Features to train on, and features held out.

    No value is in both: training has the other levels and the other repeats; held out are the held-out levels (all
    repeats) and the held-out repeats of the other levels. Training has the noise of its own scatter alone; what is held
    out, often of two repeats, has that of the whole campaign.

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
    variance, together = (each[tested.point] for each in _noise(campaign, everything))
    return _table(training, *_noise(campaign, training)), _table(tested, variance, together)


def _table(average: Averages, variance: FloatColumn, together: FloatColumn) -> FeatureTable:
    return FeatureTable(
        **{name: getattr(average.first, name) for name in POINT},
        value=average.mean,
        deviation=np.sqrt(variance / average.n * np.minimum(together, average.n)),
        n=average.n,
        spread=_spread(average.sweep_point, average.sweep_mean, average.sweep_n, variance),
    )


def _noise(campaign: Campaign, average: Averages) -> tuple[FloatColumn, FloatColumn]:
    """Variance of one value, and how many values count as one, at every point, shape (k,) each."""
    first, dof, squares = average.first, average.dof, average.squares
    variance, together = np.full(len(first), np.nan), np.ones(len(first))
    blocks = starts_of(first, ("test", "sensor", "harmonic"))
    for start, stop in zip(blocks, [*blocks[1:], len(first)], strict=True):
        block = slice(start, stop)
        if not dof[block].any():
            test, sensor = campaign.tests[first.test[start]].name, campaign.sensors[first.sensor[start]].name
            raise CampaignError(
                f'test "{test}", sensor "{sensor}": no point was measured twice in one sweep, so its noise is '
                "not known; measure repeats, or hold out fewer"
            )
        together[block] = estimate_design_effect(average.effect[block], squares[block], dof[block])
        # Values that err together with a correlation rho tell less of their variance: by 1 + rho^2 for pairs.
        certain = dof[block] / (1 + (together[block] - 1) ** 2)
        scatter = squares[block] / np.maximum(dof[block], 1.0)
        variance[block] = pool_variance(np.abs(average.mean[block]), scatter, certain)
    return variance, together


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
