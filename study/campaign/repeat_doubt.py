"""Detection of supposed repeats whose resonances are further apart than the width of their peaks.

With several modes in the band, the mode with the highest peak may change from run to run. The peaks of two runs are
therefore paired mode by mode, and the highest peak of each is compared with its partner.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.metric.curve_peak import CurvePeak, find_own_peaks
from correlation.metric.mode_pairing import pair_modes
from study.campaign.column_role import Role
from study.campaign.draft import ManifestDraft, Run
from study.campaign.draft_frequency import (
    find_harmonic_of_rows,
    make_complex_force,
    make_complex_response,
    pair_responses_with_phases,
)
from study.campaign.repeat import find_run_direction, find_run_level

Series = Float[NDArray[np.float64], " n"]


def doubt_repeats(draft: ManifestDraft) -> Iterator[str]:
    """Find repeats with different resonances: one sentence on the worst pair of each group of repeats.

    The half-power width of a peak is due to damping: two responses whose peaks are further apart do not have the same
    resonance, whatever their noise.

    Parameters
    ----------
    draft
        Draft with numbered repeats.
    """
    groups: dict[tuple[object, ...], list[Run]] = {}
    for run in draft.entries["run"]:
        if isinstance(run, Run) and "frequency" in run["columns"]:
            harmonic = find_harmonic_of_rows(run.judged, run.get("rows", {}))
            key = (
                run["test"],
                f"{find_run_level(run):.3g}",
                find_run_direction(run),
                harmonic,
                *sorted(run["columns"]),
            )
            groups.setdefault(key, []).append(run)
    for (test, level, *_), runs in groups.items():
        curves = [(run, curve) for run in runs if (curve := read_peaks(*_response(run)))]
        apart = [
            (share, a, b)
            for (a, one), (b, other) in combinations(curves, 2)
            if (share := compare_peaks(one, other)) is not None
        ]
        if apart:
            share, a, b = max(apart, key=lambda item: item[0])
            yield (
                f'test "{test}": runs "{a.name}" and "{b.name}" are taken as repeats, but their resonances are '
                f"{100 * share:.2g} % apart, more than the width of their peaks: are they different tests? Then give "
                f"each run a separate test (level {level})"
            )


def _response(run: Run) -> tuple[Series, Series]:
    """Frequencies [Hz] and moduli of the first response, per force if there is one."""
    judged = run.judged
    mask = judged.mask(run.get("rows", {}))
    column, partner = pair_responses_with_phases(judged)[0]
    values, force = make_complex_response(judged, column, partner), make_complex_force(judged)
    size = np.abs(column.values if values is None else values)[mask]
    if force is not None and (np.abs(force[mask]) > 0).all():
        size = size / np.abs(force[mask])
    return np.asarray(judged.of_role(Role.FREQUENCY)[0].values.real[mask]), size


@dataclass(frozen=True, kw_only=True, eq=False)
class WidePeak:
    """Peak and its half-power width, between the nearest values on both sides below 1/sqrt(2) of it [Hz]."""

    peak: CurvePeak
    width: float


def read_peaks(frequency: Series, size: Series) -> tuple[WidePeak, ...]:
    """Peaks of a response, the highest first.

    Parameters
    ----------
    frequency, size
        Frequencies in any order and moduli of the response, shape (n,) each. Of several at one frequency the largest
        is used.

    Returns
    -------
    Peaks that fall to half of their power on both sides before the next peak; none if the highest one does not, such as
    in a response that is largest at an end of the band.
    """
    there = np.isfinite(frequency) & np.isfinite(size)
    lines, place = np.unique(frequency[there], return_inverse=True)
    curve = np.zeros(len(lines))
    np.maximum.at(curve, place, size[there])
    result = [wide for peak in find_own_peaks(lines, curve) if (wide := _measure_width(peak, lines, curve)) is not None]
    result.sort(key=lambda wide: -float(wide.peak.shape[0].real))
    return tuple(result) if result and result[0].peak.shape[0].real == curve.max() else ()


def _measure_width(peak: CurvePeak, frequency: Series, size: Series) -> WidePeak | None:
    """Peak with its width; None if it does not fall to half of its power on both sides."""
    half = size < peak.shape[0].real / np.sqrt(2)
    low = frequency[half & (frequency >= peak.low) & (frequency < peak.frequency)]
    high = frequency[half & (frequency <= peak.high) & (frequency > peak.frequency)]
    return WidePeak(peak=peak, width=float(high[0] - low[-1])) if len(low) and len(high) else None


def compare_peaks(one: Sequence[WidePeak], other: Sequence[WidePeak]) -> float | None:
    """Relative frequency difference of the highest peak of each of two responses to its partner in the other [-].

    Parameters
    ----------
    one, other
        Peaks, the highest first.

    Returns
    -------
    Largest difference; None if no difference exceeds the larger width of the two peaks. A peak without a partner is
    compared with the highest peak of the other response.
    """
    pairs = pair_modes([{0: item.peak} for item in one], [{0: item.peak} for item in other])
    back = {theirs: own for own, theirs in pairs.items()}
    compared = [(one[0], other[pairs.get(0, 0)]), (one[back.get(0, 0)], other[0])]
    apart = [
        abs(a.peak.frequency / b.peak.frequency - 1)
        for a, b in compared
        if abs(a.peak.frequency - b.peak.frequency) > max(a.width, b.width)
    ]
    return max(apart, default=None)
