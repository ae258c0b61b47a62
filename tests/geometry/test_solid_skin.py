"""The skin of solids whose faces, edges and corners are known in closed form."""

import cadquery as cq
import numpy as np
import pytest
from numpy.typing import NDArray

from geometry.solid_skin import Facets, SolidSkin

#: A block of 20 x 30 x 40 mm with a hole of radius 6 mm through its middle, along z.
SIZE, RADIUS = (0.020, 0.030, 0.040), 0.006


@pytest.fixture(scope="module")
def skin() -> SolidSkin:
    return SolidSkin(
        cq.Workplane().box(20, 30, 40, centered=False).faces(">Z").workplane(centerOption="CenterOfMass").hole(12).val()
    )


def volume(facets: Facets) -> float:
    a, b, c = facets.points[facets.triangles].swapaxes(0, 1)
    return float(np.einsum("ti,ti->", a, np.cross(b, c)) / 6)


def test_facets_close_the_solid_and_approach_its_volume(skin: SolidSkin) -> None:
    expected = np.prod(SIZE) - np.pi * RADIUS**2 * SIZE[2]
    errors = []
    for deflection in (1e-4, 1e-6):
        facets = skin.facets(deflection)
        sides = facets.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()
        # Each side of a triangle is run through once in each sense: closed, and looking outwards all over.
        assert sorted(map(tuple, sides)) == sorted((b, a) for a, b in sides)
        errors.append(abs(volume(facets) / expected - 1))
    assert errors[1] < errors[0] < 1e-3
    assert set(facets.face) == set(range(len(skin.faces)))


def test_points_go_to_planes_and_cylinders_along_their_normals(skin: SolidSkin) -> None:
    generator = np.random.default_rng(1)
    middle = np.array([SIZE[0] / 2, SIZE[1] / 2, 0])
    for number, face in enumerate(skin.faces):
        points = np.array(face.Center().toTuple()) * 1e-3 + generator.uniform(-1e-3, 1e-3, (5, 3))
        if face.geomType() == "CYLINDER":
            points = middle + np.array([RADIUS, 0, 0.01]) + generator.uniform(-1e-3, 1e-3, (5, 3))
        result = skin.to_face(number, points)
        if face.geomType() == "CYLINDER":
            np.testing.assert_allclose(np.hypot(*(result - middle).T[:2]), RADIUS, rtol=1e-12)
            np.testing.assert_allclose(result[:, 2], points[:, 2], atol=1e-15)
        else:
            normal = np.array(face.normalAt().toTuple())
            plane = np.array(face.Center().toTuple()) @ normal * 1e-3
            np.testing.assert_allclose(result @ normal, plane, atol=1e-15)
            np.testing.assert_allclose(np.cross(result - points, normal), 0, atol=1e-15)


def face_at(skin: SolidSkin, centre: tuple[float, float, float]) -> int:
    places = np.array([face.Center().toTuple() for face in skin.faces]) * 1e-3
    return int(np.linalg.norm(places - centre, axis=1).argmin())


def test_points_go_to_the_edge_between_two_faces_and_not_beyond_its_ends(skin: SolidSkin) -> None:
    left, front = face_at(skin, (0, 0.015, 0.02)), face_at(skin, (0.01, 0, 0.02))
    for z, expected in ((0.013, 0.013), (-0.002, 0.0), (0.05, 0.040)):
        result = skin.to_edge({left, front}, np.array([1e-4, 2e-4, z]))
        np.testing.assert_allclose(result, [0, 0, expected], atol=1e-12)
    bore, top = face_at(skin, (0.01, 0.015, 0.02)), face_at(skin, (0.01, 0.015, 0.04))
    result = skin.to_edge({bore, top}, np.array([0.01 + 0.8 * 0.0063, 0.015 + 0.6 * 0.0063, 0.0397]))
    np.testing.assert_allclose(result, [0.01 + 0.8 * RADIUS, 0.015 + 0.6 * RADIUS, 0.04], atol=1e-9)
    # Opposite sides share no edge.
    assert skin.to_edge({left, face_at(skin, (0.02, 0.015, 0.02))}, np.zeros(3)) is None


def test_points_go_to_the_corner_where_their_faces_meet(skin: SolidSkin) -> None:
    faces = [face_at(skin, centre) for centre in ((0, 0.015, 0.02), (0.01, 0.03, 0.02), (0.01, 0.015, 0))]
    np.testing.assert_allclose(skin.to_corner(faces, np.array([1e-3, 0.028, 1e-3])), [0, 0.03, 0], atol=1e-12)
    assert skin.to_corner([*faces, face_at(skin, (0.02, 0.015, 0.02))], np.zeros(3)) is None


def in_groups(skin: SolidSkin) -> NDArray[np.int64]:
    return np.unique(skin.group)


def test_faces_that_run_smoothly_into_each_other_are_one_group(skin: SolidSkin) -> None:
    assert len(in_groups(skin)) == len(skin.faces)
    rounded = SolidSkin(cq.Workplane().box(20, 20, 20).edges("|Z").fillet(4).val())
    # Four sides and four fillets are one group; top and bottom are apart.
    assert len(rounded.faces) == 10
    assert len(in_groups(rounded)) == 3
