r"""Contact forces whose cables are swapped: T of one line with T of another, or T and N of one line.

The fundamentals of two lines may be equal where their means are not, so that all harmonics are used, including 0. Since
a mean depends on the friction history, only points are used at which the two forces differ by more than the scatter of
the repeats. At these, a correct force is near its own expected value and a swapped one near that of the other, in units
of the distance between both.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import CONTACT_FORCE, Campaign, Measurement, Suspicion
from correlation.data_quality.repeat_array import Repeats, arrange_repeats
from correlation.feature.table import FeatureTable
from correlation.row_group import group_rows

#: Two forces are distinguishable at a point if they differ by at least this multiple of the scatter of the repeats [-],
MIN_DISTANCE = 4.0
#: and in a harmonic with at least this number of such points.
FEWEST = 3
#: Largest distance that counts as near, and least one as far, relative to that of both forces (medians) [-].
NEAR_SHARE, FAR_SHARE = 1 / 4, 3 / 4
#: Least number of other repeats as a reference for one.
OTHERS = 2

#: Values of two forces, shape (2, n).
Pair = Complex[NDArray[np.complex128], "2 n"]


def find_swapped_forces(
    campaign: Campaign, table: FeatureTable, predicted: Complex[NDArray[np.complex128], " k"]
) -> Iterator[Suspicion]:
    """Pairs of contact forces that agree with the model only if they are swapped.

    Parameters
    ----------
    campaign
        Campaign with its sensors.
    table
        Features as measured.
    predicted
        Prediction of the model for each row, shape (k,).
    """
    scatter = _scatter(campaign.measurement, table)
    every = np.ones(len(table.value), dtype=np.bool_)
    for i, j in _list_pairs(campaign):
        parts = [("", every)]
        parts += [(f" at {level:.4g} {campaign.drive.unit}", table.level == level) for level in np.unique(table.level)]
        for where, part in parts:
            if result := _find_clearest_harmonic(
                _compute_distances_from_model(table, predicted, scatter, (i, j), part)
            ):
                yield Suspicion(
                    where=f'sensors "{campaign.sensors[i].name}" and "{campaign.sensors[j].name}" look swapped{where}',
                    sentence=f"{_describe(result)} between the model's values of both, and {result[2]:.0%} if they are "
                    "swapped (medians): check the cables",
                )
                if not where:
                    break  # at all levels


def _compute_distances_from_model(
    table: FeatureTable,
    predicted: Complex[NDArray[np.complex128], " k"],
    scatter: Float[NDArray[np.float64], " k"],
    pair: tuple[int, int],
    part: Bool[NDArray[np.bool_], " k"],
) -> list[tuple[int, float, float]]:
    """For each harmonic, the distances of a part of the readings of two forces from those of the model."""
    evidence = []
    for harmonic in np.unique(table.harmonic).tolist():
        rows = np.array(table.common_rows(*pair, harmonic))
        rows = rows[:, np.isfinite(predicted[rows]).all(axis=0) & part[rows].all(axis=0)]
        if rows.size:
            distances = _compute_distances(table.value[rows], predicted[rows], scatter[rows].max(axis=0))
            evidence.append((harmonic, *distances))
    return evidence


def find_forces_swapped_in_a_repeat(campaign: Campaign) -> Iterator[Suspicion]:
    """Pairs of contact forces that agree with their other repeats only if they are swapped in one.

    Parameters
    ----------
    campaign
        Campaign with at least three repeats.
    """
    for test in range(len(campaign.tests)):
        table = campaign.measurement.where(campaign.measurement.test == test)
        harmonics = np.unique(table.harmonic).tolist()
        for i, j in _list_pairs(campaign):
            values = {harmonic: arrange_repeats(table, (i, j), harmonic).value for harmonic in harmonics}
            result = []
            for column, repeat in enumerate(np.unique(table.repeat).tolist()):
                evidence = _compute_distances_from_others(values, column)
                if clearest := _find_clearest_harmonic(evidence):
                    result.append((clearest, repeat))
            if result:
                # A swapped repeat also affects the reference of the others: only the clearest one is reported.
                clearest, repeat = min(result, key=lambda item: item[0][2])
                names = f'"{campaign.sensors[i].name}" and "{campaign.sensors[j].name}"'
                yield Suspicion(
                    where=f'test "{campaign.tests[test].name}", repeat {repeat}',
                    sentence=f"{names}: {_describe(clearest)} between both in the other repeats, and {clearest[2]:.0%} "
                    "if they are swapped (medians): were their cables or columns swapped in this repeat?",
                )


def _compute_distances_from_others(values: dict[int, Repeats], column: int) -> list[tuple[int, float, float]]:
    """For each harmonic, the distances of one repeat from the median of the others."""
    evidence = []
    for harmonic, both in values.items():
        others = np.delete(both, column, axis=2)
        there = np.isfinite(both[:, :, column]).all(axis=0) & (np.isfinite(others).sum(axis=2) >= OTHERS).all(axis=0)
        if there.any():
            others = others[:, there]
            usual = np.nanmedian(others.real, axis=2) + 1j * np.nanmedian(others.imag, axis=2)
            noise = np.nanmax(np.abs(others - usual[:, :, None]), axis=(0, 2))
            evidence.append((harmonic, *_compute_distances(both[:, there, column], usual, noise)))
    return evidence


def _list_pairs(campaign: Campaign) -> list[tuple[int, int]]:
    forces = [number for number, sensor in enumerate(campaign.sensors) if sensor.quantity == CONTACT_FORCE]
    return list(combinations(forces, 2))


def _compute_distances(value: Pair, usual: Pair, noise: Float[NDArray[np.float64], " n"]) -> tuple[float, float]:
    """Distances of a pair from its expected and from its swapped values, over that between both (medians)."""
    apart = np.abs(usual[0] - usual[1])
    rows = (apart > MIN_DISTANCE * noise) & (apart > 0)
    if rows.sum() < FEWEST:
        return np.nan, np.nan
    own = np.abs(value - usual).max(axis=0)[rows] / apart[rows]
    swapped = np.abs(value[::-1] - usual).max(axis=0)[rows] / apart[rows]
    return float(np.median(own)), float(np.median(swapped))


def _find_clearest_harmonic(evidence: list[tuple[int, float, float]]) -> tuple[int, float, float] | None:
    """The harmonic with the clearest evidence of a swap; None without evidence, or if a harmonic contradicts it."""
    result = [item for item in evidence if item[2] < NEAR_SHARE and item[1] > FAR_SHARE]
    # A mean depends on the friction history: it does not contradict a clear harmonic.
    if not result or any(harmonic and own < NEAR_SHARE and swapped > FAR_SHARE for harmonic, own, swapped in evidence):
        return None
    return min(result, key=lambda item: item[2])


def _describe(swap: tuple[int, float, float]) -> str:
    quantity = "their means are" if swap[0] == 0 else f"their harmonics {swap[0]} are"
    return f"{quantity} off by {swap[1]:.0%} of the distance"


def _scatter(measurement: Measurement, table: FeatureTable) -> Float[NDArray[np.float64], " k"]:
    """Largest distance of a repeat or sweep from their mean, for each row of the means, shape (k,)."""
    columns = np.concatenate([_point_columns(measurement), _point_columns(table)])
    first, group = group_rows(list(columns.T))
    value, (own, asked) = measurement.value, np.split(group, [len(measurement.value)])
    size, count = len(first), np.bincount(own)
    mean = np.bincount(own, value.real, size) + 1j * np.bincount(own, value.imag, size)
    largest = np.zeros(size)
    np.maximum.at(largest, own, np.abs(value - mean[own] / count[own]))
    return np.asarray(largest[asked])


def _point_columns(table: Measurement | FeatureTable) -> Float[NDArray[np.float64], "k 5"]:
    return np.column_stack([table.test, table.level, table.frequency, table.harmonic, table.sensor])
