"""Repeats that differ by a large common factor over the whole sweep: undeclared levels."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_quality.repeat_array import arrange_repeats

#: Largest usual ratio of repeats, by a drifting gain or a reassembled joint [-].
FACTOR = 1.5
#: Least fraction of the points that differ by more than that, and least number of points.
SHARE, FEWEST = 0.9, 5


def find_common_factors(size: Float[NDArray[np.float64], "n r"]) -> Float[NDArray[np.float64], " r"] | None:
    """Factors of passes that differ by more than `FACTOR` at nearly all points.

    Parameters
    ----------
    size
        Sizes of n readings in r passes, NaN where a pass lacks one.

    Returns
    -------
    Median of each pass relative to the smallest, NaN for passes of too few points; None if all are repeats.
    """
    size = np.where(size > 0, size, np.nan)
    base = int(np.argmax(np.isfinite(size).sum(axis=0)))
    ratio = np.log(size) - np.log(size[:, base : base + 1])
    long = np.isfinite(ratio).sum(axis=0) >= FEWEST
    factor = np.full(size.shape[1], np.nan)
    apart = False
    for column in np.flatnonzero(long).tolist():
        least, factor[column], most = np.nanquantile(ratio[:, column], [1 - SHARE, 0.5, SHARE])
        apart |= bool(least > np.log(FACTOR) or most < -np.log(FACTOR))
    return np.exp(factor - np.nanmin(factor)) if apart else None


def format_factors(factors: Float[NDArray[np.float64], " r"]) -> str:
    """Factors in the form 1 : 3 : 10."""
    return " : ".join(f"{factor:.2g}" for factor in factors)


def find_missing_levels(campaign: Campaign) -> Iterator[Suspicion]:
    """Tests whose repeats of a level are probably different levels.

    Parameters
    ----------
    campaign
        Campaign with its single readings.
    """
    sensors = campaign.structure_sensors
    table = campaign.measurement
    for number, test in enumerate(campaign.tests):
        if test.settling:
            continue  # its readings differ since they settle
        for level in np.unique(table.level[table.test == number]):
            repeats, values, *_ = arrange_repeats(table.where((table.test == number) & (table.level == level)), sensors)
            factors = find_common_factors(np.abs(values).reshape(-1, len(repeats))) if len(repeats) > 1 else None
            if factors is None:
                continue
            long = np.isfinite(factors)
            listed = ", ".join(str(repeat) for repeat, there in zip(repeats, long.tolist(), strict=True) if there)
            yield Suspicion(
                where=f'test "{test.name}"',
                sentence=f"repeats {listed} at {level:.4g} {campaign.drive.unit} differ by factors "
                f"{format_factors(factors[long])} over the whole sweep: they seem to be several levels; give each run "
                "its level, or levels = [...] with a number for each sweep of its file",
            )
