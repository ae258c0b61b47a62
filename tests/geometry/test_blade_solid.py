"""The rig's blade in CAD against closed forms for cones, bevels and blocks."""

from dataclasses import fields
from math import acos, log, pi, radians, sin, sqrt, tan

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from geometry.blade import Blade
from geometry.blade_solid import blade_part
from geometry.dimension import CONE
from geometry.errors import GeometryError
from geometry.part import MILLIMETRES_PER_METRE, Part

# The kernel's adaptive quadrature of a volume is asked for 1e-9; areas use its fixed rule, seven digits or better.
VOLUME_TOLERANCE = 1e-9
AREA_TOLERANCE = 1e-7
# Round-off of coordinates of about 100 mm in the kernel, seen in metres.
PLACE = 1e-12


def section_area(blade: Blade) -> float:
    """Rectangle in the middle and a trapezium at each edge."""
    bevel = (blade.chord - blade.flat_width) / 2
    return blade.flat_width * blade.thickness + bevel * (blade.thickness + blade.edge_thickness)


def segment_area(radius: float, lip: float) -> float:
    """Part of a circle above a chord at height `lip` over its centre."""
    return radius**2 * acos(lip / radius) - lip * sqrt(radius**2 - lip**2)


def groove_volume(blade: Blade) -> float:
    """Integral of the segment area over the cone, in closed form by its radius."""
    lip = blade.lip_above_axis

    def antiderivative(radius: float) -> float:
        mouth = sqrt(radius**2 - lip**2)
        return (radius**3 * acos(lip / radius) - 2 * lip * radius * mouth + lip**3 * log(radius + mouth)) / 3

    ends = antiderivative(blade.wide_groove_radius) - antiderivative(blade.narrow_groove_radius)
    return ends / tan(blade.cone_half_angle)


def volume(blade: Blade) -> float:
    root = blade.root_chord * blade.root_thickness * blade.root_height
    pad = blade.flat_width * (blade.pad_face - blade.thickness / 2) * (blade.pad_top - blade.pad_bottom)
    return section_area(blade) * blade.length + root + 2 * (pad - groove_volume(blade))


@pytest.fixture(scope="module")
def blade() -> Blade:
    return Blade()


@pytest.fixture(scope="module")
def part(blade: Blade) -> Part:
    return blade_part(blade)


def test_volume_equals_the_closed_form(blade: Blade, part: Part) -> None:
    np.testing.assert_allclose(part.volume, volume(blade), rtol=VOLUME_TOLERANCE)


def test_bounding_box_is_block_and_tip(blade: Blade, part: Part) -> None:
    x, y = blade.root_chord / 2, max(blade.root_thickness / 2, blade.pad_face)
    expected = [[-x, -y, -blade.root_height], [x, y, blade.length]]
    # The kernel widens boxes by its own tolerance, 1e-7 mm.
    np.testing.assert_allclose(part.bounding_box, expected, atol=2e-10)


def test_clamp_is_the_two_faces_of_the_block_normal_to_y(blade: Blade, part: Part) -> None:
    clamp = part.faces["clamp"]
    assert len(clamp.faces) == 2
    np.testing.assert_allclose(clamp.area, 2 * blade.root_chord * blade.root_height, rtol=AREA_TOLERANCE)
    np.testing.assert_allclose(clamp.centre, [0, 0, -blade.root_height / 2], atol=PLACE)
    sides = sorted(face.Center().y for face in clamp.faces)
    half = MILLIMETRES_PER_METRE * blade.root_thickness / 2
    np.testing.assert_allclose(sides, [-half, half], atol=MILLIMETRES_PER_METRE * PLACE)


def test_root_bottom_and_tip_are_block_and_section(blade: Blade, part: Part) -> None:
    bottom, tip = part.faces["root_bottom"], part.faces["tip"]
    np.testing.assert_allclose(bottom.area, blade.root_chord * blade.root_thickness, rtol=AREA_TOLERANCE)
    np.testing.assert_allclose(bottom.centre, [0, 0, -blade.root_height], atol=PLACE)
    np.testing.assert_allclose(tip.area, section_area(blade), rtol=AREA_TOLERANCE)
    np.testing.assert_allclose(tip.centre, [0, 0, blade.length], atol=PLACE)


@pytest.mark.parametrize(("name", "side"), [("groove_positive", 1), ("groove_negative", -1)])
def test_groove_seen_along_its_axis_is_the_difference_of_two_segments(
    blade: Blade, part: Part, name: str, side: int
) -> None:
    groove = part.faces[name]
    lip = blade.lip_above_axis
    seen = segment_area(blade.wide_groove_radius, lip) - segment_area(blade.narrow_groove_radius, lip)
    # Every normal of a cone makes the same angle with its axis, so that the area is the projected one over its sine.
    np.testing.assert_allclose(groove.area, seen / sin(blade.cone_half_angle), rtol=AREA_TOLERANCE)
    assert abs(groove.centre[0]) < 1e-9  # symmetric; the kernel's fixed quadrature of each half is no better
    assert blade.thickness / 2 < side * groove.centre[1] < blade.pad_face
    assert blade.pad_bottom < groove.centre[2] < blade.groove_axis + blade.wide_groove_radius


@pytest.mark.parametrize(("name", "side"), [("pad_positive", 1), ("pad_negative", -1)])
def test_pad_face_is_a_rectangle_less_a_segment(blade: Blade, part: Part, name: str, side: int) -> None:
    pad = part.faces[name]
    width, height, lip = blade.flat_width, blade.pad_top - blade.pad_bottom, blade.lip_above_axis
    hole = segment_area(blade.wide_groove_radius, lip)
    np.testing.assert_allclose(pad.area, width * height - hole, rtol=AREA_TOLERANCE)
    # First moments about the groove's axis; a segment's is two thirds of the cubed half chord.
    moment = width * height * (lip + height / 2) - 2 / 3 * (blade.wide_groove_radius**2 - lip**2) ** 1.5
    centre = [0, side * blade.pad_face, blade.groove_axis + moment / (width * height - hole)]
    np.testing.assert_allclose(pad.centre, centre, atol=1e-9)  # the kernel's fixed quadrature of an arc


@pytest.mark.parametrize("side", ["positive", "negative"])
def test_contact_stations_lie_on_the_groove_with_its_normal(part: Part, side: str) -> None:
    import cadquery as cq

    line, groove = part.contact_lines[f"contact_{side}"], part.faces[f"groove_{side}"]
    for station, normal in zip(line.stations, line.normal, strict=True):
        point = cq.Vector(*station) * MILLIMETRES_PER_METRE
        for face in groove.faces:
            # Both halves meet in the crest. Within 1 pm: the kernel's round-off on coordinates of 100 mm.
            assert face.distance(cq.Vertex.makeVertex(*point.toTuple())) < 1e-9
            np.testing.assert_allclose(face.normalAt(point).toTuple(), normal, atol=1e-9)
        # The normal leaves the body, whatever sense the kernel gives to its faces. [mm]
        assert not part.solid.isInside(point + cq.Vector(*normal) * 0.01)
        assert part.solid.isInside(point - cq.Vector(*normal) * 0.01)


@pytest.mark.parametrize("side", ["positive", "negative"])
def test_one_edge_of_the_solid_carries_the_contact_line(part: Part, side: str) -> None:
    import cadquery as cq

    stations = [
        cq.Vertex.makeVertex(*(MILLIMETRES_PER_METRE * at)) for at in part.contact_lines[f"contact_{side}"].stations
    ]
    # Within 1 pm: the kernel's round-off on coordinates of 100 mm.
    carriers = [edge for edge in part.solid.Edges() if all(edge.distance(station) < 1e-9 for station in stations)]
    assert len(carriers) == 1


def test_named_points_lie_on_the_surface(part: Part) -> None:
    import cadquery as cq

    for point in part.points.values():
        vertex = cq.Vertex.makeVertex(*(MILLIMETRES_PER_METRE * point))
        assert min(face.distance(vertex) for face in part.solid.Faces()) < 1e-9


def test_the_solid_is_one_valid_body(part: Part) -> None:
    assert part.solid.ShapeType() == "Solid"
    assert part.solid.isValid()


def test_named_faces_do_not_overlap(part: Part) -> None:
    named = [face for region in part.faces.values() for face in region.faces]
    assert len(set(named)) == len(named)


def test_faces_keep_their_names_when_pad_and_block_end_in_one_plane() -> None:
    blade = Blade(root_thickness=2 * Blade().pad_face)
    part = blade_part(blade)
    np.testing.assert_allclose(part.faces["clamp"].area, 2 * blade.root_chord * blade.root_height, rtol=AREA_TOLERANCE)
    assert part.faces["pad_positive"].centre[2] > 0


@pytest.mark.parametrize(
    "dimensions",
    [
        {"edge_thickness": 0.01, "thickness": 0.01},
        {"flat_width": 0.04, "chord": 0.04},
        {"flat_width": 0.04, "chord": 0.04, "edge_thickness": 0.01, "thickness": 0.01},
        {"chord": 0.06, "root_chord": 0.06},
        {"thickness": 0.01, "root_thickness": 0.01},
        {"root_chord": 0.04 + 1e-9, "chord": 0.04},
        {"cone_half_angle": CONE["cone_half_angle"][0]},
        {"cone_half_angle": radians(44), "contact_length": 0.004},
    ],
    ids=["no bevel", "all flat", "rectangle", "flush chord", "flush thickness", "1 nm proud", "flattest", "steep"],
)
def test_limiting_shapes_are_built_with_the_closed_form_volume(dimensions: dict[str, float]) -> None:
    blade = Blade(**dimensions)
    part = blade_part(blade)
    # A cone of vanishing taper loses digits in the closed form, a difference of cubes over a small slope.
    np.testing.assert_allclose(part.volume, volume(blade), rtol=1e-8)
    np.testing.assert_allclose(part.faces["clamp"].area, 2 * blade.root_chord * blade.root_height, rtol=AREA_TOLERANCE)


@settings(max_examples=10, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(factors=st.fixed_dictionaries(dict.fromkeys((field.name for field in fields(Blade)), st.floats(0.6, 1.6))))
def test_whatever_is_accepted_is_one_solid_of_the_closed_form_volume(factors: dict[str, float]) -> None:
    default = Blade()
    try:
        blade = Blade(**{name: value * getattr(default, name) for name, value in factors.items()})
    except GeometryError:
        assume(False)
    part = blade_part(blade)
    np.testing.assert_allclose(part.volume, volume(blade), rtol=VOLUME_TOLERANCE)


def test_segment_closed_form_meets_the_half_circle() -> None:
    # Guards the test's own formula: a chord through the centre leaves half the circle. Round-off of pi / 2.
    assert segment_area(2.0, 0.0) == pytest.approx(2 * pi, rel=1e-15)
