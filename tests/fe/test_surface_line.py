"""Contact lines found on a mesh alone: places, frames and lengths against a block and a cylinder."""

from dataclasses import replace

import numpy as np
import pytest

from fe.element import HEX8, HEX20, TET10
from fe.element.table import Element
from fe.errors import MeshError
from fe.face_integral import find_outer_faces
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.surface_line import line_along_edge, line_between
from geometry.errors import GeometryError

RADIUS, HEIGHT = 0.01, 0.03


def block(element: Element) -> Mesh:
    """20 x 30 x 40 mm with the faces "top" (z = 40 mm) and "side" (y = 0)."""
    mesh = mesh_blocks([Block(shape=lambda u, v, w: (0.02 * u, 0.03 * v, 0.04 * w), counts=(2, 3, 4))], element)
    return with_faces(mesh, {"top": (2, 0.04), "side": (1, 0.0), "bottom": (2, 0.0)})


def with_faces(mesh: Mesh, planes: dict[str, tuple[int, float]]) -> Mesh:
    faces = find_outer_faces(mesh)
    sets = {}
    for name, (axis, at) in planes.items():
        probe = [Mesh(points=mesh.points, cells=mesh.cells, face_sets={"f": face[None]}).nodes("f") for face in faces]
        sets[name] = faces[[bool(np.allclose(mesh.points[nodes, axis], at, atol=1e-12)) for nodes in probe]]
    return replace(mesh, face_sets=sets)


def cylinder(element: Element = TET10) -> Mesh:
    """Around z: a square lattice bent to a disc; faces "end" (z = HEIGHT) and "round"."""
    n = 8

    def disc(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        # A ring from half the radius outwards, cut at an angle of 0.
        r, angle = RADIUS * (1 + v) / 2, 2 * np.pi * u
        return r * np.cos(angle), r * np.sin(angle), HEIGHT * w

    # Mirrored blocks are turned right by the mesher.
    mesh = mesh_blocks([Block(shape=disc, counts=(2 * n, 1, 3))], element)
    mesh = with_faces(mesh, {"end": (2, HEIGHT)})
    outer = find_outer_faces(mesh)
    kept = []
    for face in outer:
        nodes = Mesh(points=mesh.points, cells=mesh.cells, face_sets={"f": face[None]}).nodes("f")
        kept.append(bool(np.allclose(np.hypot(*mesh.points[nodes, :2].T), RADIUS, rtol=1e-6)))
    return replace(mesh, face_sets={**mesh.face_sets, "round": outer[kept]})


@pytest.mark.parametrize("element", [HEX8, HEX20, TET10])
def test_a_line_on_a_plane_face_has_its_frame_and_the_lengths_of_the_trapezoidal_rule(element: Element) -> None:
    ends = np.array([0.003, 0.004, 0.04]), np.array([0.015, 0.009, 0.04])
    line = line_between(block(element), "rub", "top", ends, 5)
    along = (ends[1] - ends[0]) / 0.013
    # Round-off of places of some centimetres.
    np.testing.assert_allclose(line.stations, np.linspace(*ends, 5), atol=1e-15)
    np.testing.assert_allclose(line.normal, np.tile([0, 0, 1.0], (5, 1)), atol=1e-12)
    np.testing.assert_allclose(line.tangents[:, 0], np.tile(along, (5, 1)), atol=1e-12)
    np.testing.assert_allclose(line.tangents[:, 1], np.tile(np.cross([0, 0, 1.0], along), (5, 1)), atol=1e-12)
    np.testing.assert_allclose(line.tributary_length, 0.013 / 4 * np.array([0.5, 1, 1, 1, 0.5]), rtol=1e-12)


@pytest.mark.parametrize("element", [HEX8, HEX20, TET10])
def test_an_edge_of_two_faces_runs_anticlockwise_about_the_first_or_from_its_start(element: Element) -> None:
    mesh = block(element)
    line = line_along_edge(mesh, "rim", ("top", "side"), 4)
    np.testing.assert_allclose(line.stations, np.linspace([0, 0, 0.04], [0.02, 0, 0.04], 4), atol=1e-15)
    np.testing.assert_allclose(line.normal, np.tile([0, 0, 1.0], (4, 1)), atol=1e-12)
    turned = line_along_edge(mesh, "rim", ("top", "side"), 4, start=np.array([0.03, 0, 0.04]))
    np.testing.assert_allclose(turned.stations, line.stations[::-1], atol=1e-15)
    assert turned.tributary_length.sum() == pytest.approx(0.02, rel=1e-12)


def test_the_rim_of_a_cylinder_is_closed_and_even_with_radial_normals() -> None:
    mesh = cylinder()
    start = RADIUS * np.array([np.cos(0.8), np.sin(0.8), HEIGHT / RADIUS])
    line = line_along_edge(mesh, "rim", ("round", "end"), 12, start=start)
    angle = np.arctan2(line.stations[:, 1], line.stations[:, 0])
    step = np.diff(np.unwrap(angle))
    # Clockwise about the end is anticlockwise about the mantle. Parabolas over 1/16 of a circle miss it by 1e-5.
    np.testing.assert_allclose(step, -2 * np.pi / 12, rtol=1e-3)
    assert abs(angle[0] - np.pi / 4) < 1e-6  # the corner nearest to the start
    np.testing.assert_allclose(np.hypot(*line.stations[:, :2].T), RADIUS, rtol=1e-4)
    # Their slopes miss it by 1 % at the corners: h^2 / (24 R^2) of a turn of 22 degrees.
    np.testing.assert_allclose(line.normal[:, :2], line.stations[:, :2] / RADIUS, atol=1e-2)
    np.testing.assert_allclose(line.normal[:, 2], 0, atol=1e-9)
    assert line.tributary_length.sum() == pytest.approx(2 * np.pi * RADIUS, rel=1e-4)


def test_a_generator_of_a_cylinder_has_the_normal_of_the_mantle() -> None:
    ends = np.array([0, RADIUS, 0.002]), np.array([0, RADIUS, 0.028])
    line = line_between(cylinder(), "generator", "round", ends)
    np.testing.assert_allclose(line.normal, np.tile([0, 1.0, 0], (7, 1)), atol=1e-2)
    np.testing.assert_allclose(line.tangents[:, 0], np.tile([0, 0, 1.0], (7, 1)), atol=1e-9)


def test_lines_that_are_none_are_refused() -> None:
    mesh = block(TET10)
    here, there = np.array([0.003, 0.004, 0.04]), np.array([0.015, 0.009, 0.04])
    with pytest.raises(MeshError, match='the line "rub" begins where it ends'):
        line_between(mesh, "rub", "top", (here, here))
    with pytest.raises(MeshError, match=r'station 2 of "rub", at \(.*\) mm, is 1 mm from the nearest face'):
        line_between(mesh, "rub", "top", (here, there + np.array([0, 0, 1e-3])), 2)
    with pytest.raises(MeshError, match='the line "rub" is perpendicular to the face "top"'):
        line_between(mesh, "rub", "top", (here, here + np.array([0, 0, 1e-7])), 2)
    with pytest.raises(GeometryError, match="cannot have 1 stations"):
        line_between(mesh, "rub", "top", (here, there), 1)
    with pytest.raises(MeshError, match='the line "rim" cannot have 1 stations'):
        line_along_edge(mesh, "rim", ("top", "side"), 1)
    with pytest.raises(MeshError, match='the faces "top" and "bottom" do not meet: name two'):
        line_along_edge(mesh, "rim", ("top", "bottom"))
    both = np.concatenate([mesh.face_sets["top"], mesh.face_sets["bottom"]])
    twice = replace(mesh, face_sets={**mesh.face_sets, "ends": both})
    with pytest.raises(MeshError, match='the faces "ends" and "side" meet in 2 edges: split'):
        line_along_edge(twice, "rim", ("ends", "side"))
