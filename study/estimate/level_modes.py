"""Modes in stepped sines of one level: frequency and damping of each, averaged over its repeats.

The mode with the highest peak may change from repeat to repeat and from level to level. The peaks of each repeat, found
from all its sensors together, are therefore tracked over the repeats before averaging.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.errors import CampaignError
from correlation.metric.curve_peak import CurvePeak, find_curve_peaks
from correlation.metric.mode_pairing import Mode, track_modes
from correlation.modal.backbone import fit_peak
from correlation.noise.smoothness import estimate_curve_noise

Series = Float[NDArray[np.float64], " f"]
#: Ascending frequencies [Hz], and moduli per force, of each sensor by its number.
Curves = Mapping[int, tuple[Series, Series]]


@dataclass(frozen=True, kw_only=True)
class LevelMode:
    """A mode at one level.

    Parameters
    ----------
    frequency, frequency_deviation
        Frequency and its standard deviation [Hz].
    damping, damping_deviation
        Damping ratio and its standard deviation [-]; NaN where unknown.
    peak
        Peak in the first repeat that shows the mode.
    """

    frequency: float
    frequency_deviation: float
    damping: float
    damping_deviation: float
    peak: CurvePeak

    @property
    def size(self) -> float:
        """Euclidean norm of the responses of all sensors at the peak, each relative to its largest [-]."""
        return float(np.linalg.norm(np.nan_to_num(self.peak.shape)))


def read_level_modes(campaign: Campaign, own: Bool[NDArray[np.bool_], " n"]) -> list[LevelMode]:
    """Read the modes of one test at one level.

    Parameters
    ----------
    campaign
        Campaign.
    own
        Mask of the rows of its table: fundamental harmonic of one test at one level, shape (n,).

    Returns
    -------
    Modes by ascending frequency.
    """
    table = campaign.measurement
    repeats = [_list_curves(campaign, own & (table.repeat == repeat)) for repeat in np.unique(table.repeat[own])]
    largest: dict[int, float] = {}
    for curves in repeats:
        for sensor, (_, size) in curves.items():
            largest[sensor] = max(largest.get(sensor, 0.0), float(size.max()))
    modes = track_modes([_find_peaks(curves, largest) for curves in repeats])
    result = [_read_mode(campaign, repeats, mode) for mode in modes if _is_in_most(mode, repeats)]
    return [mode for mode in result if mode is not None]


def _list_curves(campaign: Campaign, own: Bool[NDArray[np.bool_], " n"]) -> Curves:
    """Curves of the motion sensors in one repeat, averaged over its sweeps."""
    table, curves = campaign.measurement, dict[int, tuple[Series, Series]]()
    for sensor in np.unique(table.sensor[own]).tolist():
        if campaign.sensors[sensor].line is not None:
            continue
        rows = np.flatnonzero(own & (table.sensor == sensor))
        frequency, place = np.unique(table.frequency[rows], return_inverse=True)
        size = np.bincount(place, np.abs(table.value[rows]) / table.force[rows]) / np.bincount(place)
        curves[sensor] = frequency, size
    return curves


def _find_peaks(curves: Curves, largest: Mapping[int, float]) -> tuple[CurvePeak, ...]:
    """Peaks of one repeat; the responses are normalised by the largest response of each sensor."""
    if not curves:
        return ()
    grid = np.unique(np.concatenate([frequency for frequency, _ in curves.values()]))
    motion = np.full((len(largest), len(grid)), np.nan, dtype=np.complex128)
    noise = np.zeros(motion.shape)
    for row, (sensor, top) in enumerate(largest.items()):
        if sensor in curves and top > 0:
            frequency, size = curves[sensor]
            deviation, _ = estimate_curve_noise(frequency, size.astype(complex), parts=1)
            motion[row] = np.interp(grid, frequency, size / top, left=np.nan, right=np.nan)
            noise[row] = np.interp(grid, frequency, np.nan_to_num(deviation) / top)
    return find_curve_peaks(grid, motion, noise)


def _is_in_most(mode: Mode, repeats: Sequence[Curves]) -> bool:
    """Whether the mode is in most of the repeats that contain its frequency; a peak by noise is in one repeat alone."""
    own = np.mean([peak.frequency for peak in mode.values()])
    beyond = [curves for curves in repeats if any(lines[0] < own < lines[-1] for lines, _ in curves.values())]
    return 2 * len(mode) > len(beyond)


def _read_mode(campaign: Campaign, repeats: Sequence[Curves], mode: Mode) -> LevelMode | None:
    """Mode as fitted to the sensor with the most certain frequency; None if no sensor allows a fit of its peak."""
    by_sensor = []
    for sensor in sorted({sensor for number in mode for sensor in repeats[number]}):
        result = list[tuple[float, ...]]()
        for number, peak in sorted(mode.items()):
            if sensor not in repeats[number]:
                continue
            frequency, size = repeats[number][sensor]
            span = (frequency >= peak.low) & (frequency <= peak.high)
            try:
                result.append(fit_peak(frequency[span], size[span], None, campaign.sensors[sensor].quantity))
            except CampaignError:
                continue
        by_sensor += [np.array(result)] if result else []
    if not by_sensor:
        return None
    # Only the sensor with the most certain frequency is used: peaks of the others contain parts of other modes.
    peaks = min(by_sensor, key=lambda table: float(np.nan_to_num(np.median(table[:, 3]), nan=np.inf)))
    count = np.sqrt(len(peaks))
    return LevelMode(
        frequency=float(peaks[:, 2].mean()),
        frequency_deviation=float(np.fmax(peaks[:, 2].std() / count, np.median(peaks[:, 3]))),
        damping=float(np.median(peaks[:, 4])),
        damping_deviation=float(np.fmax(peaks[:, 4].std() / count, np.median(peaks[:, 5]))),
        peak=mode[min(mode)],
    )
