"""Runs that were taken for repeats and are not alike: their resonances are further apart than their peaks are wide."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from study.campaign.column_role import Role
from study.campaign.draft import Draft, Run
from study.campaign.draft_frequency import complex_force, complex_response, harmonic_of_rows, responses_with_phases
from study.campaign.repeat import run_direction, run_level

Series = Float[NDArray[np.float64], " n"]


def doubt_repeats(draft: Draft) -> Iterator[str]:
    """Pairs of repeats whose resonances differ, one sentence for each test and level.

    The half-power width of a peak is what damping alone spreads: two responses whose peaks are further apart share no
    resonance, whatever their noise.

    Parameters
    ----------
    draft
        Draft whose runs have their repeats.
    """
    groups: dict[tuple[object, ...], list[Run]] = {}
    for run in draft.entries["run"]:
        if isinstance(run, Run) and "frequency" in run["columns"]:
            harmonic = harmonic_of_rows(run.judged, run.get("rows", {}))
            key = (run["test"], f"{run_level(run):.3g}", run_direction(run), harmonic, *sorted(run["columns"]))
            groups.setdefault(key, []).append(run)
    for (test, level, *_), runs in groups.items():
        peaks = [(run, peak) for run in runs if (peak := _peak(run)) is not None]
        apart = [
            (abs(one[0] / other[0] - 1), a, b)
            for (a, one), (b, other) in combinations(peaks, 2)
            if abs(one[0] - other[0]) > max(one[1], other[1])
        ]
        if apart:
            share, a, b = max(apart, key=lambda item: item[0])
            yield (
                f'test "{test}": runs "{a.name}" and "{b.name}" are taken for repeats, and their resonances are '
                f"{100 * share:.2g} % apart, more than their peaks are wide: are they other tests? Then give each run "
                f"the name of its own test (level {level})"
            )


def _peak(run: Run) -> tuple[float, float] | None:
    """Frequency and half-power width of the largest peak of the first response to the force; None without one."""
    judged = run.judged
    mask = judged.mask(run.get("rows", {}))
    column, partner = responses_with_phases(judged)[0]
    values, force = complex_response(judged, column, partner), complex_force(judged)
    size = np.abs(column.values if values is None else values)[mask]
    if force is not None and (np.abs(force[mask]) > 0).all():
        size = size / np.abs(force[mask])
    return peak_and_width(np.asarray(judged.of_role(Role.FREQUENCY)[0].values.real[mask]), size)


def peak_and_width(frequency: Series, size: Series) -> tuple[float, float] | None:
    """Frequency of the largest of some values, and the distance of the values on either side that fall to 1/sqrt(2).

    Parameters
    ----------
    frequency, size
        Frequencies in any order and sizes of a response, shape (n,) each.

    Returns
    -------
    Both in the unit of the frequency; None where the peak is not within the frequencies.
    """
    there = np.isfinite(frequency) & np.isfinite(size)
    order = np.argsort(frequency[there], kind="stable")
    frequency, size = frequency[there][order], size[there][order]
    if not len(size):
        return None
    peak = int(np.argmax(size))
    low = np.flatnonzero(size[:peak] < size[peak] / np.sqrt(2))
    high = np.flatnonzero(size[peak:] < size[peak] / np.sqrt(2))
    if not len(low) or not len(high):
        return None
    return float(frequency[peak]), float(frequency[peak + high[0]] - frequency[low[-1]])
