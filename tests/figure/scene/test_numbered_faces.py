"""Numbered faces of a solid: every face is drawn, those that look away from both eyes too."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from figure.scene.numbered_faces import SIZE, Surface, save_numbered_faces
from figure.scene.off_screen import require_egl
from geometry.errors import MissingSoftware


@pytest.fixture(autouse=True)
def _screen() -> None:
    try:
        require_egl()
    except MissingSoftware as reason:
        pytest.skip(str(reason))


def cube() -> list[Surface]:
    """Six faces of two triangles, their normals outward."""
    square = np.array([[-1.0, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
    turns = [np.eye(3), np.diag([1.0, -1, -1])]
    turns += [np.array([[0, 0, s], [0, 1, 0], [-s, 0, 0]], float) for s in (1, -1)]
    turns += [np.array([[1, 0, 0], [0, 0, s], [0, -s, 0]], float) for s in (1, -1)]
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return [(square @ turn.T, triangles) for turn in turns]


def drawn(surfaces: list[Surface], file: Path) -> np.ndarray:
    picture = Image.open(save_numbered_faces(surfaces, file, title="Cube")).convert("RGB")
    assert picture.size == SIZE
    return np.asarray(picture)


def test_every_face_of_a_cube_is_drawn_in_one_of_the_two_views(tmp_path: Path) -> None:
    pixels = drawn(cube(), tmp_path / "cube.png").reshape(-1, 3)
    shades, counts = np.unique(pixels, axis=0, return_counts=True)
    # A plane face has one shade; letters, edges and smoothed borders have few pixels of each.
    faces = shades[(counts > 3000) & (shades.min(axis=1) < 250)]
    assert len(faces) == 6


def test_a_face_that_looks_away_from_both_eyes_is_drawn_without_a_number(tmp_path: Path) -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    pixels = drawn([(corners, np.array([[0, 2, 1]]))], tmp_path / "below.png")
    assert (pixels < 250).any()
