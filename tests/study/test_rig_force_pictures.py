"""Which curves of a rig are drawn: of each level the one that comes nearest to slipping as a whole."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from fe.element import HEX8
from fe.mesher.block import Block, mesh_blocks
from figure.response_curves import DrawnCurve, _choose_line_styles
from study.kind.rig.force_pictures import MOST_CURVES, choose_most_loaded
from study.kind.rig.pictures import AMPLITUDE, LARGEST_DEFLECTION, _choose_amplitude


def peak(*ratio: float) -> Any:
    return SimpleNamespace(lines={str(k): SimpleNamespace(ratio=item) for k, item in enumerate(ratio)})


def test_of_each_level_the_most_loaded_curve_is_drawn() -> None:
    peaks = [peak(0.2, 0.1), peak(0.1, 0.3), peak(0.7, 0.2), peak(0.5, 0.6)]
    assert choose_most_loaded([1.0, 1.0, 3.0, 3.0], peaks) == [1, 2]
    many = [float(level) for level in range(9)]
    shown = choose_most_loaded(many, [peak(0.5)] * 9)
    assert len(shown) == MOST_CURVES
    assert (shown[0], shown[-1]) == (0, 8)


def test_curves_of_one_level_have_one_colour_and_their_own_lines() -> None:
    def curve(group: float | None) -> DrawnCurve:
        return DrawnCurve(label="", parameter=np.ones(2), response=np.ones(2, dtype=np.complex128), group=group)

    looks = _choose_line_styles([curve(group) for group in (1.0, 1.0, 5.0, 5.0)])
    colours, lines = zip(*looks, strict=True)
    assert colours[0] == colours[1] != colours[2] == colours[3]
    assert lines[0] == lines[2] != lines[1] == lines[3]
    # Without groups each has its colour, and no line is broken.
    colours, lines = zip(*_choose_line_styles([curve(None)] * 3), strict=True)
    assert len(set(colours)) == 3
    assert set(lines) == {"-"}


def test_a_mode_of_a_small_body_is_drawn_small() -> None:
    box = Block(shape=lambda u, v, w: (0.2 * u, 0.2 * v, 0.2 * w), counts=(20, 20, 20), faces={})
    mesh = mesh_blocks([box], HEX8)
    small = (np.abs(mesh.points - [0.1, 0.1, 0.1]) < [0.05, 0.0101, 0.0051]).all(axis=1)
    assert _choose_amplitude(mesh, small[:, None] * np.ones(3)) < AMPLITUDE
    np.testing.assert_allclose(_choose_amplitude(mesh, small[:, None] * np.ones(3)), LARGEST_DEFLECTION * 0.02)
    assert _choose_amplitude(mesh, np.ones_like(mesh.points)) == AMPLITUDE
