"""Measured families: all curves of a sensor at one level, one for each repeat and sweep.

With friction the steady state depends on its history, so that repeats of one test differ by more than noise. A family
contains all of these curves, without averaging, and including jumps.

If the force of each point was measured, amplitudes are scaled to the force of the level. With friction the dependence
of amplitudes on the force is unknown beforehand (power 1 while contacts stick): the change by scaling is therefore
taken as uncertainty, unless limits determine the dependence (`correlation.family.correction`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Measurement
from geometry.read_only_array import freeze_fields

Values = Float[NDArray[np.float64], " n"]
Both = Float[NDArray[np.float64], "2 p"]

#: Frequencies of different curves belong to one point of the test if they differ by less than this share of the
#: distance to the next point [-].
ALIGNED = 0.4
#: Fields of a curve with one value per point.
COLUMNS = ("frequency", "value", "ratio", "scaled", "uncertain")


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyCurve:
    """Readings of one pass through the frequencies.

    Parameters
    ----------
    test
        Name of the test.
    repeat
        Number of the repeat.
    sweep
        +1 up, -1 down, 0 none.
    frequency
        Frequencies, ascending, shape (n,) [Hz].
    value
        Amplitudes, scaled to the force of the level, or signed means of harmonic 0, shape (n,) [SI unit of the sensor].
    ratio
        Measured force over that of the level, shape (n,) [-]; 1 by default.
    scaled
        Uncertainty by the scaling to the level, as a share of the value, shape (n,) [-]; 0 by default.
    uncertain
        Standard deviations of the distances from the lower and the upper limit by the correction of `correct_family`,
        shape (2, n) [unit of the value]; 0 by default.
    """

    test: str
    repeat: int
    sweep: int
    frequency: Values
    value: Values
    ratio: Values | float = 1.0
    scaled: Values | float = 0.0
    uncertain: Both | float = 0.0

    def __post_init__(self) -> None:
        n = len(self.frequency)
        for name, shape in (("ratio", (n,)), ("scaled", (n,)), ("uncertain", (2, n))):
            object.__setattr__(self, name, np.broadcast_to(getattr(self, name), shape))
        freeze_fields(self, *COLUMNS)

    def where(self, rows: NDArray[np.int64] | NDArray[np.bool_] | slice) -> "FamilyCurve":
        """The curve restricted to some of its points."""
        return replace(self, **{name: getattr(self, name)[..., rows] for name in COLUMNS})


@dataclass(frozen=True, kw_only=True, eq=False)
class Family:
    """All curves of one sensor and harmonic at one level of the jointed structure.

    Parameters
    ----------
    sensor
        Name of the sensor.
    harmonic
        0 for means, 1 for amplitudes of the fundamental, and so on.
    level
        Level of the excitation [N, or the unit of the drive].
    curves
        Curves by test, repeat and sweep.
    """

    sensor: str
    harmonic: int
    level: float
    curves: tuple[FamilyCurve, ...]

    @property
    def n_point(self) -> int:
        """Number of readings [-]."""
        return sum(len(curve.frequency) for curve in self.curves)

    @property
    def frequency(self) -> Values:
        """Frequencies of all readings, curve after curve, shape (p,) [Hz]."""
        return np.concatenate([curve.frequency for curve in self.curves])

    @property
    def value(self) -> Values:
        """All readings, curve after curve, shape (p,)."""
        return np.concatenate([curve.value for curve in self.curves])

    @property
    def ratio(self) -> Values:
        """Measured force of each reading over that of the level, curve after curve, shape (p,) [-]."""
        return np.concatenate([curve.ratio for curve in self.curves])

    @property
    def scaled(self) -> Values:
        """Relative uncertainty of each reading by its scaling to the level, curve after curve, shape (p,) [-]."""
        return np.concatenate([curve.scaled for curve in self.curves])

    def widen(self, deviation: Both, limit: Both) -> Both:
        """Standard deviations of distances from limits, including those of the correction, shape (2, p) [their unit].

        Parameters
        ----------
        deviation, limit
            Standard deviations without the correction, and the limits, shape (2, p).
        """
        uncertain = np.concatenate([curve.uncertain for curve in self.curves], axis=1)
        return np.asarray(np.sqrt(deviation**2 + (self.scaled * limit) ** 2 + uncertain**2))

    @property
    def set_ups(self) -> list[tuple[str, int]]:
        """Test and repeat of each curve."""
        return [(curve.test, curve.repeat) for curve in self.curves]

    @property
    def curve_number(self) -> NDArray[np.int64]:
        """Number of the curve of each reading, shape (p,)."""
        return np.repeat(np.arange(len(self.curves)), [len(curve.frequency) for curve in self.curves])


def measured_families(campaign: Campaign) -> tuple[Family, ...]:
    """Families of the jointed tests of a campaign, by sensor, harmonic and level.

    Parameters
    ----------
    campaign
        Campaign; all rows are used, including held-out repeats and levels.
    """
    table = campaign.measurement
    jointed = ~campaign.is_free
    table = table.where(jointed[table.test]) if len(table) else table
    families: dict[tuple[int, int, float], list[FamilyCurve]] = {}
    for rows in _split_passes(table):
        first = table.where(rows[:1])
        key = int(first.sensor[0]), int(first.harmonic[0]), _set_point(float(first.level[0]))
        families.setdefault(key, []).append(_make_curve(campaign, table.where(rows)))
    return tuple(
        Family(sensor=campaign.sensors[sensor].name, harmonic=harmonic, level=level, curves=tuple(curves))
        for (sensor, harmonic, level), curves in sorted(families.items(), key=lambda item: item[0])
    )


def _split_passes(table: Measurement) -> list[NDArray[np.int64]]:
    """Rows of each pass, in ascending frequency."""
    if not len(table):
        return []
    columns = (table.frequency, table.sweep, table.repeat, table.test, table.level, table.harmonic, table.sensor)
    order = np.lexsort(columns)
    key = np.column_stack([column[order] for column in columns[1:]])
    starts = np.flatnonzero((np.diff(key, axis=0) != 0).any(axis=1)) + 1
    return np.split(order, starts)


def _set_point(level: float) -> float:
    """A level without the rounding of its unit."""
    return float(f"{level:.9g}")


def _make_curve(campaign: Campaign, table: Measurement) -> FamilyCurve:
    test = campaign.tests[int(table.test[0])]
    # In a test at constant response the force is not prescribed.
    force = table.force / table.level if test.control == "force" else np.ones(len(table))
    ratio = np.where(np.isfinite(force) & (force > 0), force, 1.0)
    value = table.value.real if table.harmonic[0] == 0 else np.abs(table.value) / ratio
    scaled = np.zeros(len(table)) if table.harmonic[0] == 0 else np.abs(1 / ratio - 1)
    return FamilyCurve(
        test=test.name, repeat=int(table.repeat[0]), sweep=int(table.sweep[0]),
        frequency=table.frequency, value=value, ratio=ratio, scaled=scaled,
    )  # fmt: skip


def number_points(curves: Sequence[FamilyCurve]) -> NDArray[np.int64]:
    """Number of the point of the test to which each reading belongs, curve after curve, shape (p,).

    The frequencies of repeats may differ slightly. Readings belong to one point if they are nearest to the same
    frequency of a longer curve, and clearly nearer than to the next one. If one curve has several such readings, the
    others form separate points.
    """
    place, reach = _find_places(curves)
    result: list[int] = []
    fresh = len(place)
    for curve in curves:
        taken: set[int] = set()
        for frequency in curve.frequency:
            nearest = int(np.argmin(np.abs(place - frequency)))
            if abs(place[nearest] - frequency) <= reach[nearest] and nearest not in taken:
                taken.add(nearest)
                result.append(nearest)
            else:
                result.append(fresh)
                fresh += 1
    return np.array(result, dtype=np.int64)


def _find_places(curves: Sequence[FamilyCurve]) -> tuple[Values, Values]:
    """Frequencies of the longest curve, then those of others that are near none of them, and capture ranges [Hz]."""
    place, reach = np.zeros(0), np.zeros(0)
    for curve in sorted(curves, key=lambda item: -len(item.frequency)):
        own = np.unique(curve.frequency)
        own = own[(np.abs(own[:, None] - place) > reach).all(axis=1)]
        # The capture range of a place is not reduced by places that are inserted later.
        step = np.diff(np.union1d(place, own), prepend=-np.inf, append=np.inf)
        near = ALIGNED * np.minimum(step[:-1], step[1:])[np.searchsorted(np.union1d(place, own), own)]
        place, reach = np.append(place, own), np.append(reach, near)
    return place, reach
