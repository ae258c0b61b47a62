"""Figures of a comparison: what lies on something else is seen, and nothing lies on a frame."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import Image

from figure.backbone import Backbones, draw_backbone
from figure.family_over_limits import FamiliesOverLimits, FamilyRow, draw_family_over_limits
from figure.frf_overlay import FrfOverlay, OverlayPanel, draw_frf_overlay
from figure.misfit_map import MisfitMap, draw_misfit_map
from figure.style import LIMITS, png
from tests.figure.examples import EXAMPLES


@pytest.mark.parametrize(("by", "lines"), [(0.0, 1), (0.02, 3)])
def test_lines_of_the_model_that_lie_on_each_other_are_drawn_once(by: float, lines: int) -> None:
    example: Backbones = EXAMPLES[Backbones]()
    measured, model = example.curves[0], example.curves[-1]
    models = [
        replace(model, frequency=model.frequency + number * 50 * by, damping=model.damping + number * by)
        for number in range(3)
    ]
    figure = draw_backbone(replace(example, curves=[measured, *models]))
    for axes in figure.axes:
        dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
        assert len(dashed) == lines
        assert all(np.isfinite(line.get_ydata()).all() for line in dashed)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [measured.label, model.label]


def test_a_line_of_the_model_that_lies_on_a_longer_one_is_that_one() -> None:
    example: Backbones = EXAMPLES[Backbones]()
    model = example.curves[-1]
    part = replace(
        model, amplitude=model.amplitude[10:20], frequency=model.frequency[10:20],
        frequency_deviation=model.frequency_deviation[10:20], damping=model.damping[10:20],
        damping_deviation=model.damping_deviation[10:20],
    )  # fmt: skip
    for axes in draw_backbone(replace(example, curves=[part, model])).axes:
        (line,) = axes.lines
        np.testing.assert_allclose(line.get_xdata(), model.amplitude)


def colours(picture: bytes) -> NDArray[np.int64]:
    with Image.open(BytesIO(picture)) as image:
        return np.asarray(image.convert("RGB"), dtype=np.int64)


def count(picture: bytes, colour: str) -> int:
    """Pixels of a colour."""
    rgb = np.array([round(255 * part) for part in to_rgb(colour)])
    return int((colours(picture) == rgb).all(axis=2).sum())


def limits(apart: float) -> FamiliesOverLimits:
    example: FamiliesOverLimits = EXAMPLES[FamiliesOverLimits]()
    panel = example.rows[0].panels[0]
    upper = panel.limit[1]
    limit = np.array([upper - apart * upper.max(), upper])
    same = replace(panel, limit=limit, jump=np.zeros_like(panel.jump), curves=())
    return replace(example, rows=[FamilyRow(label="tip [um]", panels=[same])])


def test_both_limits_are_seen_where_no_width_is_between_them() -> None:
    wide, none = (png(draw_family_over_limits(limits(apart))) for apart in (0.2, 0.0))
    for colour in LIMITS:
        # Of a line that is half covered about half is seen; its edges are of mixed colours, twice as many as before.
        assert count(none, colour) > 0.2 * count(wide, colour)


def test_the_legend_names_a_band_only_where_one_is_seen() -> None:
    named = [
        {text.get_text() for text in draw_family_over_limits(limits(apart)).legends[0].get_texts()}
        for apart in (0.2, 0.0)
    ]
    assert named[0] == {"upper limit", "lower limit", "all friction histories"}
    assert len(named[1]) == 1
    assert not named[0] & named[1]


@pytest.mark.parametrize("harmonics", [1, 2])
def test_the_panels_of_a_map_share_the_width_of_the_figure(harmonics: int) -> None:
    example: MisfitMap = EXAMPLES[MisfitMap]()
    chosen = sorted({panel.harmonic for panel in example.panels})[:harmonics]
    figure = draw_misfit_map(replace(example, panels=[panel for panel in example.panels if panel.harmonic in chosen]))
    meshes = [item for item in figure.axes[0].collections if isinstance(item, QuadMesh)]
    ends = np.array([np.asarray(mesh.get_coordinates())[0, [0, -1], 0] for mesh in meshes])
    np.testing.assert_allclose(np.ptp(ends, axis=1), np.ptp(ends[0]))
    assert ends.max() > figure.get_figwidth() - 0.6  # the room at the end and between panels is 0.4


@pytest.mark.parametrize("gaps", [True, False])
def test_a_map_names_the_colour_of_cells_without_data_where_it_has_some(gaps: bool) -> None:
    example: MisfitMap = EXAMPLES[MisfitMap]()
    size = np.where(np.arange(example.panels[0].size.size).reshape(3, 41) % 7 == 0, np.nan, example.panels[0].size)
    panels = [replace(example.panels[0], size=size), *example.panels[1:]] if gaps else example.panels
    figure = draw_misfit_map(replace(example, panels=panels))
    meshes = [item for item in figure.axes[0].collections if isinstance(item, QuadMesh)]
    named = [patch.get_facecolor() for patch in figure.axes[0].patches if patch.get_label() == "no data"]
    assert named == ([tuple(meshes[0].get_cmap().get_bad())] if gaps else [])
    # The name lies right of the scale and within the figure.
    figure.draw_without_rendering()
    words = [text.get_window_extent() for text in figure.axes[0].texts if text.get_text() == "no data"]
    assert all(figure.axes[1].bbox.x1 < box.x0 and box.x1 < figure.bbox.width for box in words)
    assert len(words) == gaps
    label = figure.axes[1].xaxis.label.get_window_extent()
    assert label.x0 > 0
    assert label.x1 < figure.bbox.width


def test_no_residual_or_phase_lies_on_the_frame_of_its_strip() -> None:
    example: FrfOverlay = EXAMPLES[FrfOverlay]()
    share = np.linspace(0.02, 2, len(example.panels[0].curves[0].measured))
    panels = [
        OverlayPanel(
            label=panel.label,
            unit=panel.unit,
            curves=[replace(curve, predicted=share * curve.measured) for curve in panel.curves],
        )
        for panel in example.panels
    ]
    figure = draw_frf_overlay(replace(example, panels=panels))
    figure.draw_without_rendering()
    strips = [axes for axes in figure.axes if axes.get_ylabel().startswith(("residual", "phase"))]
    assert len(strips) == 2 * len(panels)
    for axes in strips:
        frame = axes.get_window_extent()
        for line in axes.lines:
            if line.get_marker() != "o":
                continue
            height = axes.transData.transform(np.column_stack([line.get_xdata(), line.get_ydata()]))[:, 1]
            # Half of it is the point's own; as much again is between.
            clear = (line.get_markersize() + line.get_markeredgewidth()) * figure.dpi / 72
            assert height.min() - clear > frame.y0
            assert height.max() + clear < frame.y1
