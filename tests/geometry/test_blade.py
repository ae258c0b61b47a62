"""What the dimensions of the rig's blade must satisfy, before any CAD."""

from dataclasses import fields
from math import cos, inf, nan, radians, sin, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry.blade import Blade, contact_lines, named_points
from geometry.errors import GeometryError

# A few units in the last place of lengths of about 0.1 m.
ROUND_OFF = 1e-15

# A blade that can be built, spelt out: messages with numbers shall not change when the defaults are tuned.
SOUND = {
    "length": 0.25,
    "thickness": 0.01,
    "edge_thickness": 0.006,
    "chord": 0.04,
    "flat_width": 0.022,
    "root_chord": 0.06,
    "root_thickness": 0.04,
    "root_height": 0.03,
    "excitation_height": 0.02,
    "contact_height": 0.125,
    "contact_length": 0.012,
    "pad_clearance": 0.002,
    "pad_height_above_groove": 0.007,
    "lip_above_axis": 0.003,
    "groove_radius": 0.006,
    "cone_half_angle": radians(8.53),
}


@pytest.mark.parametrize(
    ("dimensions", "message"),
    [
        ({"length": -0.25}, r"length = -250 mm is not positive"),
        ({"chord": 0.0}, r"chord = 0 mm is not positive"),
        ({"thickness": nan}, r"thickness = nan mm is not finite"),
        ({"root_height": inf}, r"root_height = inf mm is not finite"),
        (
            {"length": 250.0},
            r"length = 250000 mm is longer than any rig \(in Python give metres between 1e-05 and 10\)",
        ),
        ({"pad_clearance": 2e-6}, r"pad_clearance = 0\.002 mm is thinner than can be made"),
        ({"cone_half_angle": 0.0}, r"cone_half_angle = 0 deg is not between 0\.05 and 45 deg"),
        ({"cone_half_angle": radians(45)}, r"cone_half_angle = 45 deg is not between 0\.05 and 45 deg"),
        (
            {"cone_half_angle": 8.53},
            r"cone_half_angle = 488\.733 deg is not between 0\.05 and 45 deg \(in Python give radians\)",
        ),
        ({"cone_half_angle": nan}, r"cone_half_angle = nan deg"),
        ({"edge_thickness": 0.012, "thickness": 0.01}, r"edge_thickness = 12 mm exceeds thickness = 10 mm"),
        ({"flat_width": 0.05, "chord": 0.04}, r"flat_width = 50 mm exceeds chord = 40 mm"),
        ({"root_chord": 0.03, "chord": 0.04}, r"chord = 40 mm exceeds root_chord = 30 mm"),
        ({"root_thickness": 0.005, "thickness": 0.01}, r"thickness = 10 mm exceeds root_thickness = 5 mm"),
        (
            {"contact_height": 0.003},
            r"contact_height = 3 mm puts the lower face of the pads at -0\.89\d* mm, into the root",
        ),
        ({"contact_height": 0.5, "length": 0.25}, r"contact_height = 500 mm puts .* tip at length = 250 mm"),
        ({"contact_length": 0.3, "flat_width": 0.022}, r"flat_width = 22 mm lets the groove, 10\d\.\d+ mm wide"),
        ({"lip_above_axis": 0.006}, r"lip_above_axis = 6 mm closes the groove, whose radius is 5\.7\d* mm"),
        ({"flat_width": 0.012}, r"flat_width = 12 mm lets the groove, 14\.39\d* mm wide at its mouth, break through"),
        (
            {"excitation_height": 0.125},
            r"excitation_height = 125 mm is not below the pads, which start at 12\d\.\d+ mm",
        ),
    ],
)
def test_a_blade_that_cannot_be_built_is_refused_with_field_value_and_remedy(
    dimensions: dict[str, float], message: str
) -> None:
    Blade(**SOUND)
    with pytest.raises(GeometryError, match=message):
        Blade(**(SOUND | dimensions))


def test_all_that_is_wrong_is_said_at_once_in_one_sentence() -> None:
    with pytest.raises(GeometryError) as caught:
        Blade(length=-0.25, chord=nan, edge_thickness=0.02, thickness=0.01)
    message = str(caught.value)
    assert message.startswith("the blade cannot be built: ")
    for clause in ("length = -250 mm", "chord = nan mm", "edge_thickness = 20 mm exceeds thickness = 10 mm"):
        assert clause in message
    assert "\n" not in message
    # A dimension that is wrong by itself is not compared with others as well.
    assert "exceeds root_chord" not in message


@pytest.mark.parametrize("name", [field.name for field in fields(Blade)])
@pytest.mark.parametrize("value", [-1.0, 0.0, nan, inf, 1e3])
def test_every_dimension_is_checked(name: str, value: float) -> None:
    with pytest.raises(GeometryError, match=f"{name} = "):
        Blade(**{name: value})


def test_the_groove_crest_passes_contact_height_half_way_along_the_line() -> None:
    blade = Blade()
    middle = np.array([(blade.contact_start + blade.pad_face) / 2])
    crest = blade.groove_axis + blade.groove_radius_at(middle)
    np.testing.assert_allclose(crest, blade.contact_height, atol=ROUND_OFF)


def test_groove_radius_at_the_two_ends_is_the_named_one() -> None:
    blade = Blade()
    ends = np.array([blade.thickness / 2, blade.contact_start, -blade.pad_face])
    expected = [blade.narrow_groove_radius, blade.groove_radius, blade.wide_groove_radius]
    np.testing.assert_allclose(blade.groove_radius_at(ends), expected, atol=ROUND_OFF)


def test_a_bi_conical_damper_of_fifteen_percent_taper_fits_along_the_crest() -> None:
    blade = Blade()
    # Cylinder of 6 mm, then a cone of contact length plus 1 mm; axes 2 mm apart, all as the default groove assumes.
    line = contact_lines(blade)["contact_positive"].stations
    cone = 0.006 - (blade.pad_face + 0.001 - line[:, 1]) * tan(radians(8.53))
    # 0.15 against tan(8.53 deg) over 13 mm is a tenth of a micrometre; the default groove radius is rounded so.
    np.testing.assert_allclose(line[:, 2], blade.groove_axis + 0.002 + cone, atol=2e-7)


@pytest.mark.parametrize("n_station", [2, 7, 13])
def test_tributary_lengths_sum_to_the_slant_length_of_the_line(n_station: int) -> None:
    blade = Blade()
    for line in contact_lines(blade, n_station).values():
        assert line.n_station == n_station
        slant = blade.contact_length / cos(blade.cone_half_angle)
        np.testing.assert_allclose(line.tributary_length.sum(), slant, rtol=1e-14)  # n additions of round-off
        np.testing.assert_allclose(line.stations[[0, -1], 0], 0.0, atol=0.0)
        np.testing.assert_allclose(
            np.abs(line.stations[[0, -1], 1]), [blade.contact_start, blade.pad_face], atol=ROUND_OFF
        )


@given(angle=st.floats(0.5, 12.0), contact_length=st.floats(0.004, 0.015), n_station=st.integers(2, 20))
def test_the_frame_of_every_station_is_orthonormal_and_slopes_with_the_cone(
    angle: float, contact_length: float, n_station: int
) -> None:
    blade = Blade(cone_half_angle=radians(angle), contact_length=contact_length)
    lines = contact_lines(blade, n_station)
    for side, name in ((1, "contact_positive"), (-1, "contact_negative")):
        line = lines[name]
        frame = np.concatenate([line.normal[:, None], line.tangents], axis=1)
        gram = frame @ frame.transpose(0, 2, 1)
        # Products of unit vectors whose slope comes from a difference of lengths of 0.1 m over 1 mm.
        np.testing.assert_allclose(gram, np.broadcast_to(np.eye(3), gram.shape), atol=1e-12)
        slope = np.array([0.0, side * cos(radians(angle)), sin(radians(angle))])
        np.testing.assert_allclose(line.tangents[:, 0], np.broadcast_to(slope, (n_station, 3)), atol=1e-12)
        np.testing.assert_allclose(line.tangents[:, 1], np.broadcast_to([1.0, 0, 0], (n_station, 3)), atol=0)
        assert np.all(line.normal[:, 2] < 0)


def test_the_two_lines_mirror_each_other_at_the_mid_plane() -> None:
    mirror = np.array([1.0, -1.0, 1.0])
    positive, negative = contact_lines(Blade()).values()
    np.testing.assert_array_equal(positive.stations * mirror, negative.stations)
    np.testing.assert_array_equal(positive.normal * mirror, negative.normal)


def test_a_line_of_one_station_is_refused_with_the_count() -> None:
    with pytest.raises(GeometryError, match=r'"contact_positive" cannot have 1 stations: give 2 or more'):
        contact_lines(Blade(), n_station=1)


def test_arrays_of_a_contact_line_are_read_only() -> None:
    line = contact_lines(Blade())["contact_positive"]
    with pytest.raises(ValueError, match="read-only"):
        line.stations[0, 0] = 1.0


def test_named_points_lie_on_the_face_at_positive_y() -> None:
    blade = Blade()
    points = named_points(blade)
    np.testing.assert_array_equal(points["excitation"], [0, blade.thickness / 2, blade.excitation_height])
    np.testing.assert_array_equal(points["response"], [0, blade.thickness / 2, blade.length])
