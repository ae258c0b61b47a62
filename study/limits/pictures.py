"""Pictures of the limits of one quantity: the band, contact states at the limits, and limits over level."""

import numpy as np

from figure.contact_states import ContactStates, StatePanel
from figure.limit_band import Band, LimitBands
from figure.limit_levels import LimitsByLevel
from hbsolve.limits.result import SIDES
from reduction.array_type import Whole
from study.limits.result import LimitCurves
from study.solve.result import DRAWN_STATES

#: Largest number of readable columns in a figure.
MOST_LEVELS = 6


def name_levels(curves: LimitCurves, *, in_newtons: bool) -> list[str]:
    """Name each level."""
    return [f"{level:g} N" if in_newtons else f"level {level:g}" for level in curves.limits.level]


def choose_levels(curves: LimitCurves) -> Whole:
    """Choose the indices of at most `MOST_LEVELS` levels, with the first and the last."""
    n_level = len(curves.limits.level)
    return np.unique(np.linspace(0, n_level - 1, min(n_level, MOST_LEVELS)).round().astype(np.int64))


def make_band(curves: LimitCurves, level: int, label: str) -> Band:
    """Make the band of one level over frequency."""
    return Band(
        label=label,
        frequency=curves.limits.frequency,
        value=curves.value[:, level],
        sampled=curves.sampled[:, level],
        jump=curves.jump[:, level],
        repaired=curves.repaired[:, level],
    )


def draw_limits(curves: LimitCurves, title: str, *, in_newtons: bool) -> dict[str, object]:
    """Make the figures of one quantity, by name."""
    limits = curves.limits
    drawn: dict[str, object] = {}
    names = name_levels(curves, in_newtons=in_newtons)
    if len(limits.frequency) > 1:
        bands = [make_band(curves, level, name) for level, name in enumerate(names)]
        drawn["limits"] = LimitBands(bands=bands, title=f"{title}: {curves.quantity}", amplitude_label=curves.label)
        panels = [
            [
                StatePanel(
                    label=f"{SIDES[side]} limit, {names[level]}",
                    parameter=limits.frequency,
                    states=DRAWN_STATES,
                    share=curves.share[side, level],
                )
                for level in choose_levels(curves)
            ]
            for side in (1, 0)
        ]
        drawn["limit_states"] = ContactStates(
            panels=panels, title=f"{title}: contact states at the limits", parameter_label="frequency [Hz]"
        )
    if len(limits.level) > 1:
        what = "highest points" if curves.has_peaks else "range"
        drawn["limit_levels"] = _arrange_by_level(
            curves,
            title=f"{title}: {what} of both limits",
            level_label=label_level(in_newtons=in_newtons),
        )
    return drawn


def label_level(*, in_newtons: bool) -> str:
    """Label of an axis of levels."""
    return "amplitude of the force [N]" if in_newtons else "level of the harmonic force [-]"


def _arrange_by_level(curves: LimitCurves, title: str, level_label: str) -> LimitsByLevel:
    limits = curves.limits
    n_level, last = len(limits.level), len(limits.frequency) - 1
    value, frequency = np.full((2, 2, n_level), np.nan)
    doubtful = np.zeros((2, n_level), dtype=bool)
    for side, level in np.ndindex(2, n_level):
        at = curves.extreme(side, level)
        if at is not None:
            value[side, level] = curves.value[side, level, at]
            frequency[side, level] = limits.frequency[at]
            doubtful[side, level] = curves.jump[side, level, at] or (last > 0 and at in {0, last})
    return LimitsByLevel(
        level=limits.level, value=value, frequency=frequency, doubtful=doubtful, title=title,
        amplitude_label=curves.label, level_label=level_label,
    )  # fmt: skip
