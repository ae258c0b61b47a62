"""The damper in CAD against closed forms, and its crests against those of the blade's groove."""

from dataclasses import replace
from math import cos, inf, nan, pi, radians, sqrt, tan

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from geometry.blade import Blade
from geometry.blade import contact_lines as blade_lines
from geometry.damper import Damper, contact_lines, damper_part, named_points
from geometry.errors import GeometryError
from geometry.part import MILLIMETRES_PER_METRE, Part

# As for the blade: the kernel's quadrature of a volume is asked for 1e-9, its areas have seven digits.
VOLUME_TOLERANCE, AREA_TOLERANCE = 1e-9, 1e-7
# Round-off of coordinates of about 100 mm in the kernel, and a few units in the last place of lengths of 0.01 m.
PLACE, ROUND_OFF = 1e-12, 1e-16
DENSITY = 7800.0


@pytest.fixture(scope="module")
def damper() -> Damper:
    return Damper()


@pytest.fixture(scope="module")
def part(damper: Damper) -> Part:
    return damper_part(damper)


def test_it_weighs_27_grams(damper: Damper) -> None:
    # By hand: pi 36 12 + 2 pi 13/3 (36 + 6 4.05 + 4.05^2) = 3446 mm^3, of steel.
    assert 1e3 * DENSITY * damper.volume == pytest.approx(26.88, abs=0.01)


def test_volume_equals_the_closed_form(damper: Damper, part: Part) -> None:
    np.testing.assert_allclose(part.volume, damper.volume, rtol=VOLUME_TOLERANCE)


def test_bounding_box_is_the_cylinder_between_the_ends(damper: Damper, part: Part) -> None:
    high = np.array([damper.radius, damper.half_length, damper.radius])
    # The kernel widens boxes by its own tolerance, 1e-7 mm.
    np.testing.assert_allclose(part.bounding_box, [-high, high], atol=2e-10)


def test_faces_are_cones_cylinder_and_ends(damper: Damper, part: Part) -> None:
    slant = damper.cone_length / cos(damper.cone_half_angle)
    cone, end = pi * (damper.radius + damper.end_radius) * slant, pi * damper.end_radius**2
    areas = {
        "cylinder": 2 * pi * damper.radius * damper.cylinder_length,
        "cone_blade": cone, "cone_decoupler": cone, "end_blade": end, "end_decoupler": end,
    }  # fmt: skip
    assert {name: region.area for name, region in part.faces.items()} == pytest.approx(areas, rel=AREA_TOLERANCE)
    for name, region in part.faces.items():
        side = {"blade": -1.0, "decoupler": 1.0}.get(name.partition("_")[2], 0.0)
        assert np.sign(np.round(region.centre[1], 9)) == side


@pytest.mark.parametrize("name", ["contact_blade", "contact_decoupler"])
def test_contact_lines_lie_on_an_edge_of_the_model(part: Part, name: str) -> None:
    import cadquery as cq

    for station in part.contact_lines[name].stations:
        vertex = cq.Vertex.makeVertex(*(MILLIMETRES_PER_METRE * station))
        nearest = min(edge.distance(vertex) for edge in part.solid.Edges() if edge.geomType() == "LINE")
        assert nearest < MILLIMETRES_PER_METRE * PLACE


def test_frames_are_right_angled_and_point_out(damper: Damper) -> None:
    lines = contact_lines(damper)
    for line in lines.values():
        for normal, tangents, station in zip(line.normal, line.tangents, line.stations, strict=True):
            frame = np.array([normal, *tangents])
            np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=4e-16)  # round-off of three products
            assert normal @ station > 0
            assert tangents[0][1] * station[1] < 0  # to the middle
        slant = damper.contact_length / cos(damper.cone_half_angle)
        assert line.tributary_length.sum() == pytest.approx(slant, rel=1e-14)
    mirrored = lines["contact_blade"].stations * [1, -1, 1]
    np.testing.assert_allclose(mirrored, lines["contact_decoupler"].stations, atol=ROUND_OFF)


def test_its_crest_mates_with_the_blade_s_groove() -> None:
    """Equal cone angles on parallel axes: the same stations with opposite normals, once the damper is in its place."""
    blade, damper = Blade(), Damper()
    groove, crest = blade_lines(blade)["contact_positive"], contact_lines(damper)["contact_blade"]
    place = groove.stations[0] - crest.stations[0]
    # Both are 12 mm long with the same taper; round-off of heights of 0.1 m.
    np.testing.assert_allclose(crest.stations + place, groove.stations, atol=1e-16 * 100)
    np.testing.assert_allclose(crest.normal, -groove.normal, atol=4e-16)
    np.testing.assert_allclose(crest.tributary_length, groove.tributary_length, rtol=1e-13)


def test_points_lie_on_the_surface(damper: Damper, part: Part) -> None:
    import cadquery as cq

    points = named_points(damper)
    assert set(points) == {"dead_weight", "laser_blade", "laser_decoupler"}
    for point in points.values():
        vertex = cq.Vertex.makeVertex(*(MILLIMETRES_PER_METRE * point))
        assert min(face.distance(vertex) for face in part.solid.Faces()) < MILLIMETRES_PER_METRE * PLACE


@settings(max_examples=5, deadline=None)
@given(
    radius=st.floats(0.002, 0.05),
    share=st.floats(0.1, 3.0),
    contact=st.floats(0.5, 3.0),
    angle=st.floats(1.0, 20.0),
)
def test_any_damper_has_the_volume_of_its_closed_form(
    radius: float, share: float, contact: float, angle: float
) -> None:
    length = contact * radius
    assume(radius - 1.1 * length * tan(radians(angle)) > 1e-4)
    one = Damper(
        radius=radius, cylinder_length=share * radius, contact_length=length, shoulder=0.1 * length,
        cone_half_angle=radians(angle),
    )  # fmt: skip
    np.testing.assert_allclose(damper_part(one).volume, one.volume, rtol=VOLUME_TOLERANCE)


@pytest.mark.parametrize(
    ("dimensions", "message"),
    [
        ({"radius": -0.006}, r"the damper cannot be built: radius = -6 mm is not positive"),
        ({"radius": 6.0, "shoulder": nan}, r"shoulder = nan mm is not finite"),
        ({"cylinder_length": inf}, r"cylinder_length = inf mm is not finite"),
        ({"shoulder": 0.02}, r"shoulder = 20 mm exceeds contact_length = 12 mm"),
        (
            {"cone_half_angle": 8.53},
            r"cone_half_angle = 488\.733 deg is not between 0\.05 and 45 deg \(in Python give radians\)",
        ),
        (
            {"contact_length": 0.05},
            r"contact_length = 50 mm is longer than the cones, which taper to a point from radius = 6 mm",
        ),
    ],
)
def test_what_cannot_be_built_is_said_in_one_sentence(dimensions: dict[str, float], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        replace(Damper(), **dimensions)


def test_two_stations_at_least() -> None:
    with pytest.raises(GeometryError, match=r'"contact_blade" cannot have 1 stations: give 2 or more'):
        contact_lines(Damper(), 1)


def test_the_normal_is_that_of_the_cone(damper: Damper) -> None:
    (normal,) = {tuple(item) for item in contact_lines(damper)["contact_decoupler"].normal}
    assert normal[1] / normal[2] == pytest.approx(tan(damper.cone_half_angle), rel=1e-15)
    assert sqrt(sum(item**2 for item in normal)) == pytest.approx(1, rel=1e-15)
