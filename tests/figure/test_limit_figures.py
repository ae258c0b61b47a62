"""Figures of limits: no clean line through a jump, every mark in its place, nothing hidden that was not found."""

from dataclasses import replace

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from figure.force_limits import ForceLimits, LineForceLimits, force_limits_figure
from figure.limit_band import Band, LimitBands, limit_band_figure
from figure.limit_levels import LimitsByLevel, draw_limit_levels
from figure.line_force_bands import LineForceBands, draw_line_force_bands
from figure.style import LIMITS

FREQUENCY = np.array([10.0, 11.0, 12.0, 13.0, 14.0])
LOWER, UPPER = np.array([1.0, 1.5, 2.0, 1.5, np.nan]), np.array([1.0, 2.0, 4.0, 3.0, 1.0])
NONE = np.zeros((2, 5), dtype=bool)
WORDS = {"title": "Title", "amplitude_label": "amplitude [um]"}


def band(jump: np.ndarray = NONE, repaired: np.ndarray = NONE) -> Band:
    return Band(
        label="level 1", frequency=FREQUENCY, value=np.array([LOWER, UPPER]), sampled=np.full((2, 5), np.nan),
        jump=jump, repaired=repaired,
    )  # fmt: skip


def segments(figure: Figure, side: int) -> dict[tuple[float, float], str]:
    """Line style of each piece of a limit, by the frequencies that it joins."""
    lines = [line for line in figure.axes[0].lines if line.get_linestyle() != "None" and len(line.get_xdata()) == 2]
    result = [line for line in lines if to_hex(line.get_color()) == LIMITS[side]]
    return {tuple(map(float, line.get_xdata())): line.get_linestyle() for line in result}


def marks(figure: Figure, marker: str) -> list[tuple[float, float]]:
    rings = [line for line in figure.axes[0].lines if line.get_marker() == marker]
    return [(float(x), float(y)) for line in rings for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True)]


def filled(figure: Figure) -> set[tuple[float, float]]:
    """Frequencies between which the band is filled."""
    paths = [path for area in figure.axes[0].collections for path in area.get_paths()]
    return {(float(path.vertices[:, 0].min()), float(path.vertices[:, 0].max())) for path in paths}


def test_a_limit_is_dotted_on_both_sides_of_a_jump_and_the_band_is_open_there() -> None:
    jump = NONE.copy()
    jump[1, 2] = True
    drawn = limit_band_figure(LimitBands(bands=[band(jump=jump)], **WORDS))
    assert segments(drawn, 1) == {(10, 11): "-", (11, 12): ":", (12, 13): ":", (13, 14): "-"}
    assert set(segments(drawn, 0).values()) == {"-"}
    assert marks(drawn, "o") == [(12, 4)]
    assert not filled(drawn) & {(11, 12), (12, 13)}
    assert (10, 11) in filled(drawn)


def test_repaired_points_and_what_was_not_found_are_seen() -> None:
    repaired = NONE.copy()
    repaired[0, 1] = True
    drawn = limit_band_figure(LimitBands(bands=[band(repaired=repaired)] * 3, **WORDS))
    assert marks(drawn, "s") == [(11, 1.5)]
    lower = [line for line in drawn.axes[0].lines if line.get_marker() == "." and isinstance(line, Line2D)]
    assert any(np.isnan(np.asarray(line.get_ydata())).any() for line in lower)
    # Three panels, the fourth place stays empty.
    assert [axes.get_visible() for axes in drawn.axes] == [True, True, True, False]
    labels = [text.get_text() for text in drawn.legends[0].get_texts()]
    assert labels == ["upper limit", "lower limit", "between them", "found by a random history"]


def test_levels_of_one_force_share_an_axis_that_holds_all_of_them() -> None:
    low = band()
    high, negative = replace(low, value=10 * low.value), replace(low, value=-low.value)
    drawn = draw_line_force_bands(LineForceBands(bands={"T1": [low, high], "T0": [low, negative]}, title="Title"))
    first, second, third, fourth = drawn.axes
    assert first.get_ylim() == second.get_ylim()
    assert (first.get_ylim()[0], first.get_ylim()[1] > 40) == (0, True)
    assert third.get_ylim() == fourth.get_ylim()
    assert third.get_ylim()[0] < -4
    assert third.get_ylim()[1] > 4
    assert [axes.get_ylabel() for axes in (first, third)] == ["T1 [N]", "T0 [N]"]


def test_points_at_a_jump_or_an_end_are_hollow_over_the_level() -> None:
    value, doubtful = np.array([[1.0, 2.0], [3.0, 5.0]]), np.array([[False, True], [False, False]])
    limits = LimitsByLevel(level=np.array([1.0, 4.0]), value=value, frequency=100 - value, doubtful=doubtful, **WORDS)
    drawn = draw_limit_levels(limits)
    points = [line for line in drawn.axes[0].lines if line.get_marker() == "o"]
    hollow = [line for line in points if line.get_markerfacecolor() == "white" and len(line.get_xdata())]
    assert [(line.get_xdata().tolist(), line.get_ydata().tolist()) for line in hollow] == [([4.0], [2.0])]
    assert len(drawn.axes) == 2
    # One frequency for all needs no panel of its own.
    assert len(draw_limit_levels(replace(limits, frequency=np.full((2, 2), 99.0))).axes) == 1


def test_a_bar_goes_from_the_lower_to_the_upper_force_and_is_not_cut_off() -> None:
    value = np.array([[-2.0, 0.5], [1.0, 3.0]])
    panels = [
        ForceLimits(line=line, force=force, level=np.array([1.0, 4.0]), value=value, sampled=value)
        for line in ("left", "right") for force in ("T0", "N0")
    ]  # fmt: skip
    drawn = force_limits_figure(LineForceLimits(panels=panels, title="Title", sampled_label="tests"))
    axes = drawn.axes[0]
    assert [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in axes.patches] == [(-2, 1), (0.5, 3)]
    low, high = axes.get_ylim()
    assert low < -2
    assert high > 3
    assert [item.get_title("left") for item in drawn.axes] == ["left: T0", "right: T0", "left: N0", "right: N0"]
