"""Faces are found by where they lie and which way they look, whatever their number in the solid."""

import numpy as np
import pytest

from geometry.errors import GeometryError
from geometry.part import Part, Shape
from geometry.solid import block, cone_along_y, curved_faces, face_region, plane_faces, single_solid

# Planes only: the kernel's quadrature is exact but for round-off.
EXACT = 1e-13


@pytest.fixture(scope="module")
def stair() -> Shape:
    """Two bars side by side, the second higher: both have a free face in the plane y = 10 mm, looking apart."""
    low, high = block((0.0, 0.0, 0.0), (0.01, 0.01, 0.03)), block((0.0, 0.01, 0.01), (0.01, 0.02, 0.05))
    return single_solid("stair", low.fuse(high))


@pytest.mark.parametrize(("sense", "area", "height"), [(1, 1e-4, 0.005), (-1, 2e-4, 0.04)])
def test_two_faces_in_one_plane_are_told_apart_by_their_sense(
    stair: Shape, sense: int, area: float, height: float
) -> None:
    result = face_region("riser", plane_faces(stair, normal=(0, sense, 0), offset=sense * 0.01))
    np.testing.assert_allclose(result.area, area, rtol=EXACT)
    np.testing.assert_allclose(result.centre, [0.005, 0.01, height], rtol=EXACT)


def test_the_centre_of_a_region_is_weighted_by_area(stair: Shape) -> None:
    both = (*plane_faces(stair, normal=(0, 1, 0), offset=0.01), *plane_faces(stair, normal=(0, -1, 0), offset=-0.01))
    region = face_region("risers", both)
    np.testing.assert_allclose(region.area, 3e-4, rtol=EXACT)
    np.testing.assert_allclose(region.centre, [0.005, 0.01, (0.005 + 2 * 0.04) / 3], rtol=EXACT)


def test_a_cone_has_one_curved_face_and_its_volume_is_the_frustum() -> None:
    cone = cone_along_y(start=0.01, end=0.04, start_radius=0.02, end_radius=0.01, axis_height=0.05)
    assert len(curved_faces(cone, where=lambda centre: centre[1] > 0)) == 1
    assert not curved_faces(cone, where=lambda centre: centre[1] < 0)
    frustum = np.pi / 3 * 0.03 * (0.02**2 + 0.02 * 0.01 + 0.01**2)
    np.testing.assert_allclose(Part(name="cone", solid=cone).volume, frustum, rtol=1e-9)  # asked of the kernel


def test_a_name_without_a_face_is_refused(stair: Shape) -> None:
    with pytest.raises(GeometryError, match='no face of the solid is its "ceiling"'):
        face_region("ceiling", plane_faces(stair, normal=(0, 0, 1), offset=1.0))


def test_two_separate_bodies_are_refused_with_their_number() -> None:
    apart = block((0.0, 0.0, 0.0), (0.01, 0.01, 0.01)).fuse(block((0.02, 0.0, 0.0), (0.03, 0.01, 0.01)))
    with pytest.raises(GeometryError, match="the pair consists of 2 separate bodies"):
        single_solid("pair", apart)
