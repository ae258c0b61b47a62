"""The picture of a part's named faces: each colour where its face is seen, and nowhere else."""

from pathlib import Path

import numpy as np
import pytest
import scipy.ndimage
from numpy.typing import NDArray
from PIL import Image

from fe.element import TET10
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from figure.scene.body_picture import STATION_COLOUR
from figure.scene.named_faces import COLOURS, NODE_COLOURS, named_faces_picture
from figure.scene.off_screen import require_egl
from geometry.errors import MissingSoftware


def near(picture: NDArray[np.uint8], colour: str) -> int:
    """Pixels of a hue, in any light, left of the legend."""
    wanted = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)
    body = picture[:, : int(0.75 * picture.shape[1])].reshape(-1, 3).astype(float)
    own, other = body - body.mean(axis=1, keepdims=True), wanted - wanted.mean()
    size = np.linalg.norm(own, axis=1)
    return int(((own @ other > 0.985 * size * np.linalg.norm(other)) & (size > 0.5 * np.linalg.norm(other))).sum())


EYE = np.array([0.8, -0.62, 0.36])


@pytest.fixture
def mesh() -> Mesh:
    """A block with two named faces."""
    try:
        require_egl()
    except MissingSoftware as reason:
        pytest.skip(str(reason))
    block = Block(
        shape=lambda u, v, w: (0.02 * u, 0.02 * v, 0.03 * w), counts=(2, 2, 3), faces={"u1": "front", "w0": "foot"}
    )
    return mesh_blocks([block], TET10)


def test_faces_are_seen_from_their_side_alone(tmp_path: Path, mesh: Mesh) -> None:
    station = np.array([[0.02, 0.01, 0.015]])
    seen = {}
    for side, towards_eye in (("front", EYE), ("back", -EYE)):
        file = named_faces_picture(
            mesh, mesh.face_sets, station, tmp_path / f"{side}.png", title="Block", towards_eye=towards_eye
        )
        picture = np.asarray(Image.open(file).convert("RGB"))
        seen[side] = [near(picture, colour) for colour in COLOURS[:2]]
    # A face takes a tenth of the picture and more; edges and smoothing leave some pixels of any hue.
    assert min(seen["front"][0], seen["back"][1]) > 20_000
    assert max(seen["front"][1], seen["back"][0]) < 2_000


def seen(picture: NDArray[np.uint8], colour: str) -> NDArray[np.bool_]:
    """Whether pixels left of the legend have a hue, mixed or not, that no light gives the body."""
    wanted = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)
    body = picture[:, : int(0.75 * picture.shape[1])].astype(float)
    own, other = body - body.mean(axis=2, keepdims=True), wanted - wanted.mean()
    size = np.linalg.norm(own, axis=2)
    along = own @ other > 0.97 * size * np.linalg.norm(other)
    return np.asarray(along & (size > 0.25 * np.linalg.norm(other)))


def test_a_station_on_any_side_and_nodes_are_seen_in_both_pictures(tmp_path: Path, mesh: Mesh) -> None:
    stations = {"front": [0.02, 0.01, 0.015], "within": [0.01, 0.01, 0.015], "below": [0.01, 0.01, 0.0]}
    for eye in (EYE, -EYE):
        file = named_faces_picture(
            mesh, {}, np.array([*stations.values()]), tmp_path / "all.png", title="Block", towards_eye=eye
        )
        dots, count = scipy.ndimage.label(
            seen(np.asarray(Image.open(file).convert("RGB")), STATION_COLOUR), np.ones((3, 3))
        )
        assert count == len(stations)
        # A dot of 11 pixels has 95 of them, its rim smoothed.
        sizes = np.bincount(dots.ravel())[1:]
        assert ((sizes > 50) & (sizes < 150)).all()
    nodes = {"corners": mesh.points[[0, -1]]}
    file = named_faces_picture(mesh, {}, np.zeros((0, 3)), tmp_path / "nodes.png", title="Block", nodes=nodes)
    # Two dots of 10 pixels have 157 of them.
    assert 50 < seen(np.asarray(Image.open(file).convert("RGB")), NODE_COLOURS[0]).sum() < 250
