"""Measurements arranged for a comparison: one row per point, one column per repeat."""

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Measurement, number_frequencies
from correlation.errors import CampaignError
from correlation.feature.branch import classify_readings, find_branches
from correlation.feature.reading_noise import find_reading_noise
from correlation.feature.settling import find_unsettled
from correlation.prediction import Points
from correlation.row_group import group_rows
from correlation.row_table import RowTable

#: Readings of a sensor are noise if they are below this multiple of their scatter at most frequencies of a level.
MIN_SIGNAL_TO_NOISE = 2.0
#: Amplitudes without a phase are noise if they are below this multiple of their scatter at most frequencies of a level.
#: The mean of pure noise is 1.9 times its scatter (Rayleigh); at 4 times, noise adds an eighth of the scatter (Rice).
MIN_AMPLITUDE_TO_NOISE = 4.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Observation(RowTable):
    """Measurements at k points in R repeats.

    Parameters
    ----------
    points
        Points, k rows.
    repeat
        Coefficients, mean of both sweeps or of the sweep of the row, shape (k, R) [SI]; NaN where a repeat lacks the
        point, or is on another branch than most repeats.
    motion
        Whether the row's sensor measures a motion rather than a force, shape (k,).
    taken
        Mask of the repeats that are compared with a model, shape (k, R); the noise is estimated from all of them.
    phased
        Whether a row has a phase; otherwise its values are amplitudes, shape (k,); all by default.
    noise
        Standard deviation of each part of a single repeat's value, stated or estimated from the curve of the only
        repeat, shape (k,) [SI]; NaN, the default, if it is to be estimated from the repeats.
    n_reading
        Number of readings averaged in a repeat's value, such as both sweeps, shape (k,); one by default.
    """

    points: Points
    repeat: Complex[NDArray[np.complex128], "k R"]
    motion: Bool[NDArray[np.bool_], " k"]
    taken: Bool[NDArray[np.bool_], "k R"]
    phased: Bool[NDArray[np.bool_], " k"] = field(default_factory=lambda: np.zeros(0, dtype=np.bool_))
    noise: Float[NDArray[np.float64], " k"] = field(default_factory=lambda: np.zeros(0))
    n_reading: Int[NDArray[np.int64], " k"] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def __post_init__(self) -> None:
        if not len(self.phased):
            object.__setattr__(self, "phased", np.ones(len(self.points), dtype=np.bool_))
        if not len(self.noise):
            object.__setattr__(self, "noise", np.full(len(self.points), np.nan))
        if not len(self.n_reading):
            object.__setattr__(self, "n_reading", np.ones(len(self.points), dtype=np.int64))

    @property
    def value(self) -> Complex[NDArray[np.complex128], " k"]:
        """Mean of the repeats in `taken`, shape (k,)."""
        total = np.where(self.taken, self.repeat, 0.0).sum(axis=1)
        return np.asarray(total / np.maximum(self.count, 1))

    @property
    def mean(self) -> Complex[NDArray[np.complex128], " k"]:
        """Mean of all repeats with the point, whether in `taken` or not, shape (k,); NaN without any."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.nanmean(self.repeat, axis=1))

    @property
    def count(self) -> Int[NDArray[np.int64], " k"]:
        """Number of repeats in `taken`, shape (k,)."""
        return np.asarray(self.taken.sum(axis=1))

    @property
    def above_noise(self) -> Bool[NDArray[np.bool_], " k"]:
        """Mask of rows whose sensor exceeds noise in its harmonic at its level, shape (k,).

        A sensor on a body that is not connected to the excited one reads noise, whose inverse is arbitrary.
        """
        return self._exceeds_scatter(MIN_SIGNAL_TO_NOISE)

    @property
    def amplitude_of_noise(self) -> Bool[NDArray[np.bool_], " k"]:
        """Mask of rows of curves without a phase that are amplitudes of noise and cannot be compared, shape (k,)."""
        amplitude = ~self.phased & (self.points.harmonic > 0)
        # The scatter of a mean of amplitudes decreases with the number of readings, its bias does not.
        return np.asarray(amplitude & ~self._exceeds_scatter(MIN_AMPLITUDE_TO_NOISE * np.sqrt(self.n_reading)))

    def _exceeds_scatter(self, times: float | Float[NDArray[np.float64], " k"]) -> Bool[NDArray[np.bool_], " k"]:
        """Mask of rows whose curve exceeds this multiple of its scatter at most frequencies, shape (k,)."""
        points, there = self.points, np.isfinite(self.repeat)
        n = there.sum(axis=1)
        mean = np.where(there, self.repeat, 0.0).sum(axis=1) / np.maximum(n, 1)
        apart = np.where(there, np.abs(self.repeat - mean[:, None]) ** 2, 0.0).sum(axis=1)
        group = group_rows([points.free, points.level, points.sensor, points.harmonic]).number
        parts = np.where(self.phased & (points.harmonic > 0), 2, 1)
        scatter = np.where(n == 1, np.sqrt(parts) * self.noise, np.sqrt(apart / np.maximum(n - 1, 1)))
        # A point that was read once has no scatter, unless its noise is known. The majority of points decides: at a
        # jump of the response repeats differ by as much as their size.
        known_noise = np.isfinite(scatter)
        clear = np.abs(mean) >= times * np.nan_to_num(scatter)
        known_rows, above = np.bincount(group, known_noise), np.bincount(group, clear & known_noise)
        return np.asarray((2 * above >= known_rows)[group])


@lru_cache(maxsize=2)  # several parts of one comparison ask
def arrange_campaign(campaign: Campaign) -> Observation:
    """Arrange a whole campaign; a point with two branches has one row per sweep (`correlation.feature.branch`)."""
    table = campaign.measurement
    bistable, excluded = classify_readings(campaign, find_branches(campaign))
    excluded |= find_unsettled(campaign)
    sweep = np.where(bistable, table.sweep, 0)
    free_test = campaign.is_free
    frequency = table.frequency
    state_columns = [free_test[table.test], table.level, number_frequencies(frequency)]
    first, row = group_rows([*state_columns, sweep, table.sensor, table.harmonic])
    state = group_rows(state_columns).number
    _, column = np.unique(table.repeat, return_inverse=True)
    value = np.where(excluded, np.nan, table.value)
    shape = (len(first), int(column.max(initial=0)) + 1)
    repeat = average_readings(value, row, column, shape)
    names = np.array([sensor.name for sensor in campaign.sensors])
    motion = np.array([sensor.line is None for sensor in campaign.sensors])
    sensor = table.sensor[first]
    points = Points(
        free=free_test[table.test[first]],
        level=table.level[first],
        frequency=frequency[first],
        sensor=names[sensor],
        harmonic=table.harmonic[first],
        sweep=sweep[first],
        force=_average_force(table, row, state),
    )
    there = np.isfinite(repeat)
    count = np.bincount(row, np.isfinite(value), len(first)) / np.maximum(there.sum(axis=1), 1)
    n_reading = np.maximum(np.rint(count).astype(np.int64), 1)
    mean = np.where(there, repeat, 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    mean[~there.any(axis=1)] = np.nan
    return Observation(
        points=points, repeat=repeat, motion=motion[sensor], taken=there,
        phased=np.array([item.has_phase for item in campaign.sensors])[sensor],
        noise=find_reading_noise(campaign, points, mean, n_reading, there.sum(axis=1) > 1), n_reading=n_reading,
    )  # fmt: skip


def _average_force(
    table: Measurement, row: Int[NDArray[np.int64], " rows"], state: Int[NDArray[np.int64], " rows"]
) -> Float[NDArray[np.float64], " k"]:
    """Mean force of the steady state of each point, over its sensors, repeats and sweeps, shape (k,) [N]."""
    if np.array_equal(table.force, table.level):
        point_level = np.zeros(row.max(initial=-1) + 1)
        point_level[row] = table.level
        return point_level
    mean = np.bincount(state, table.force) / np.maximum(np.bincount(state), 1)
    force = np.zeros(row.max(initial=-1) + 1)
    force[row] = mean[state]
    return force


def average_readings(
    value: Complex[NDArray[np.complex128], " rows"],
    point: Int[NDArray[np.int64], " rows"],
    column: Int[NDArray[np.int64], " rows"],
    shape: tuple[int, int],
) -> Complex[NDArray[np.complex128], "k R"]:
    """Mean of the readings of each point in each repeat; NaN where there is none.

    Parameters
    ----------
    value
        Readings, shape (rows,); those that are not finite are ignored.
    point, column
        Indices of the point (-1 for none) and of the repeat of each reading, shape (rows,).
    shape
        Number of points and of repeats [-].
    """
    there = np.isfinite(value) & (point >= 0)
    place = point[there], column[there]
    total, count = np.zeros(shape, dtype=np.complex128), np.zeros(shape)
    np.add.at(total, place, value[there])
    np.add.at(count, place, 1.0)
    with np.errstate(invalid="ignore"):
        return np.where(count > 0, total / count, np.nan)


def find_points(campaign: Campaign, points: Points) -> Int[NDArray[np.int64], " rows"]:
    """Index of the point of each row of a campaign's table, shape (rows,); -1 for none."""
    table = campaign.measurement
    free_test = campaign.is_free
    names = np.array([sensor.name for sensor in campaign.sensors])
    place = number_frequencies(np.concatenate([points.frequency, table.frequency]))
    columns = (points.free, points.level, place[: len(points)], points.sensor, points.harmonic, points.sweep)
    known = zip(*(column.tolist() for column in columns), strict=True)
    number = {key: point for point, key in reversed([*enumerate(known)])}
    measured = (free_test[table.test], table.level, place[len(points) :], names[table.sensor], table.harmonic)
    rows = zip(*(column.tolist() for column in measured), strict=True)
    return np.array(
        [
            number.get((*key, 0), number.get((*key, way), -1))
            for key, way in zip(rows, table.sweep.tolist(), strict=True)
        ],
        dtype=np.int64,
    )


def find_sweep_directions(campaign: Campaign) -> tuple[int, ...]:
    """Sweep directions of the jointed structure, in the order of measurement; empty if it was not swept."""
    table = campaign.measurement
    jointed = ~campaign.is_free[table.test]
    sweep, order = table.sweep[jointed], table.order[jointed]
    result = np.unique(sweep)
    first = [order[sweep == way].min() for way in result]
    return tuple(int(way) for way in result[np.argsort(first, kind="stable")] if way)


def take_training_part(campaign: Campaign) -> Observation:
    """Training data: without held-out levels and repeats, and without points that lack a majority branch."""
    return _split_parts(campaign)[0]


def split_held_out(campaign: Campaign) -> tuple[Observation, Observation]:
    """Training data, see `take_training_part`, and the data that test the fit.

    The test uses the held-out repeats at all levels, whether held out or not; without held-out repeats, the held-out
    levels. A single set of repeats has a single jitter of its mean, which can be fitted before the test.

    Raises
    ------
    CampaignError
        Nothing is held out.
    """
    fitted, tested = _split_parts(campaign)
    if not len(tested.points):
        raise CampaignError(
            f"{campaign.folder}: nothing is held out, so neither a fit nor an effect can be tested: "
            "name a level or a repeat under "
            "[held_out]"
        )
    return fitted, tested


def _split_parts(campaign: Campaign) -> tuple[Observation, Observation]:
    everything = arrange_campaign(campaign)
    steady = everything.where(np.asarray(np.isfinite(everything.repeat).any(axis=1)))
    held_out_repeats = np.isin(np.unique(campaign.measurement.repeat), campaign.held_out.repeats)
    at_level = np.isin(steady.points.level, campaign.held_out.levels)
    tests = held_out_repeats[None, :] if held_out_repeats.any() else at_level[:, None]
    return _take_repeats(steady, ~(at_level[:, None] | held_out_repeats[None, :])), _take_repeats(steady, tests)


def _take_repeats(seen: Observation, chosen: Bool[NDArray[np.bool_], "#k #R"]) -> Observation:
    """Some repeats of some rows; rows without any of them are dropped."""
    taken = np.isfinite(seen.repeat) & chosen
    return replace(seen, taken=taken).where(np.asarray(taken.any(axis=1)))
