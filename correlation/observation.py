"""Measurements arranged for a comparison: one row a point, one column a repeat."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.measurement import Campaign
from correlation.prediction import Points

#: Frequencies of repeats that differ by less than this share are one frequency.
SAME_FREQUENCY = 1e-5


@dataclass(frozen=True, kw_only=True, eq=False)
class Observation:
    """What was measured at k points in R repeats.

    Parameters
    ----------
    points
        Where.
    repeat
        Coefficients, the mean of both sweeps, shape (k, R); NaN where a repeat lacks the point [SI].
    motion
        Whether the row's sensor follows a motion (and no force), shape (k,).
    """

    points: Points
    repeat: Complex[NDArray[np.complex128], "k R"]
    motion: Bool[NDArray[np.bool_], " k"]

    @property
    def value(self) -> Complex[NDArray[np.complex128], " k"]:
        """Mean of the repeats, shape (k,)."""
        return np.asarray(np.nanmean(self.repeat, axis=1))

    def where(self, chosen: Bool[NDArray[np.bool_], " k"]) -> "Observation":
        """Some of the rows."""
        return Observation(points=self.points.where(chosen), repeat=self.repeat[chosen], motion=self.motion[chosen])


def observation(campaign: Campaign, *, repeats: Sequence[int] | None = None) -> Observation:
    """Arrange a campaign.

    Parameters
    ----------
    campaign
        As read.
    repeats
        Those to take; all by default.

    Raises
    ------
    CampaignError
        None of these repeats was measured.
    """
    table = campaign.measurement
    chosen = np.ones(len(table.value), bool) if repeats is None else np.isin(table.repeat, list(repeats))
    if not chosen.any():
        raise CampaignError(f"{campaign.folder}: there are no measurements of repeats {list(repeats or ())}")
    free_test = np.array([test.configuration == "free" for test in campaign.tests])
    frequency = table.frequency[chosen]
    digits = np.round(np.log(frequency) / SAME_FREQUENCY).astype(np.int64)
    key = np.column_stack(
        [
            free_test[table.test[chosen]],
            np.unique(table.level[chosen], return_inverse=True)[1],
            digits,
            table.sensor[chosen],
            table.harmonic[chosen],
        ]
    ).astype(np.int64)
    _, first, row = np.unique(key, axis=0, return_index=True, return_inverse=True)
    _, column = np.unique(table.repeat[chosen], return_inverse=True)
    shape = (len(first), int(column.max()) + 1)
    total, count = np.zeros(shape, dtype=np.complex128), np.zeros(shape)
    np.add.at(total, (row.ravel(), column), table.value[chosen])
    np.add.at(count, (row.ravel(), column), 1.0)
    with np.errstate(invalid="ignore"):
        repeat = np.where(count > 0, total / count, np.nan)
    names = np.array([sensor.name for sensor in campaign.sensors])
    motion = np.array([sensor.line is None for sensor in campaign.sensors])
    sensor = table.sensor[chosen][first]
    points = Points(
        free=free_test[table.test[chosen][first]],
        level=table.level[chosen][first],
        frequency=frequency[first],
        sensor=names[sensor],
        harmonic=table.harmonic[chosen][first],
    )
    return Observation(points=points, repeat=repeat, motion=motion[sensor])


def training(campaign: Campaign) -> Observation:
    """What a model may be fitted to: neither held-out levels nor held-out repeats."""
    held = campaign.held_out
    repeats = sorted(set(campaign.measurement.repeat.tolist()) - set(held.repeats))
    seen = observation(campaign, repeats=repeats)
    return seen.where(~np.isin(seen.points.level, held.levels))


def held_out(campaign: Campaign) -> Observation:
    """What tests a fit: the held-out repeats at all levels, and all repeats at the held-out levels.

    Raises
    ------
    CampaignError
        Nothing is held out.
    """
    held = campaign.held_out
    everything = observation(campaign)
    kept = np.isin(np.unique(campaign.measurement.repeat), held.repeats)
    at_level = np.isin(everything.points.level, held.levels)
    if not (kept.any() or at_level.any()):
        raise CampaignError(
            f"{campaign.folder}: nothing is held out, so that no effect can be tested: name a level or a repeat under "
            "[held_out]"
        )
    repeat = everything.repeat.copy()
    repeat[np.ix_(~at_level, ~kept)] = np.nan
    seen = Observation(points=everything.points, repeat=repeat, motion=everything.motion)
    return seen.where(np.asarray(np.isfinite(repeat).any(axis=1)))
