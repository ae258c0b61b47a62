"""The five bodies in their places: lines that mate, bodies that do not overlap, and what is refused."""

from dataclasses import replace
from math import acos, radians, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from geometry.blade import Blade
from geometry.damper import Damper, damper_part
from geometry.decoupler import Decoupler
from geometry.errors import GeometryError
from geometry.interference import check_no_overlap, overlaps
from geometry.part import MILLIMETRES_PER_METRE, Part
from geometry.placement import Placement
from geometry.rig import Rig, mating_pairs, named_points, placements, rig_parts
from geometry.step_io import write_assembly_step

BODIES = ("blade", "damper_left", "decoupler_left", "damper_right", "decoupler_right")
# Round-off of coordinates of about 100 mm.
PLACE = 1e-12


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig()


@pytest.fixture(scope="module")
def parts(rig: Rig) -> dict[str, Part]:
    return rig_parts(rig)


def test_five_bodies_are_symmetric_about_the_blade(parts: dict[str, Part]) -> None:
    assert set(parts) == set(BODIES)
    assert all(part.name == name for name, part in parts.items())
    for body in ("damper", "decoupler"):
        left, right = parts[f"{body}_left"], parts[f"{body}_right"]
        assert left.volume == pytest.approx(right.volume, rel=1e-9)
        mirrored = left.bounding_box * [1, -1, 1]
        np.testing.assert_allclose(np.sort(mirrored, axis=0), right.bounding_box, atol=2e-10)
        for name, region in left.faces.items():
            np.testing.assert_allclose(region.centre * [1, -1, 1], right.faces[name].centre, atol=PLACE)
            # The faces moved with the solid, and are its own.
            own = {face.hashCode() for face in left.solid.Faces()}
            assert {face.hashCode() for face in region.faces} <= own
            there = np.mean([face.Center().toTuple() for face in region.faces], axis=0) / MILLIMETRES_PER_METRE
            np.testing.assert_allclose(there, region.centre, atol=1e-9)


@pytest.mark.parametrize(
    "rig",
    [Rig(), Rig(blade=Blade(groove_radius=0.007)), Rig(decoupler=Decoupler(groove_radius=0.0055)),
     Rig(damper=Damper(radius=0.0055)), Rig(blade=Blade(contact_height=0.09))],
)  # fmt: skip
def test_generators_mate_within_a_micrometre(rig: Rig) -> None:
    pairs = mating_pairs(rig)
    assert set(pairs) == {"left_blade", "left_decoupler", "right_blade", "right_decoupler"}
    for pair in pairs.values():
        np.testing.assert_allclose(pair.damper_line.stations, pair.other_line.stations, atol=1e-15)
        np.testing.assert_allclose(pair.damper_line.normal, -pair.other_line.normal, atol=4e-16)
        np.testing.assert_allclose(pair.damper_line.tangents, pair.other_line.tangents, atol=4e-16)
        assert pair.damper_line.n_station == 7


def test_generators_are_in_the_solids(rig: Rig, parts: dict[str, Part]) -> None:
    """The kernel's own distance between solids: they touch, and only where the stations are."""
    import cadquery as cq

    for pair in mating_pairs(rig).values():
        damper, other = parts[pair.damper].solid, parts[pair.other].solid
        assert damper.distance(other) < 1e-6  # mm, of 1e-3 that mating lines may be apart
        for station in pair.damper_line.stations:
            vertex = cq.Vertex.makeVertex(*(MILLIMETRES_PER_METRE * station))
            assert max(damper.distance(vertex), other.distance(vertex)) < 1e-9


def test_nothing_overlaps(parts: dict[str, Part]) -> None:
    assert overlaps(parts) == {}
    check_no_overlap(parts)


def test_a_damper_pressed_into_its_grooves_overlaps_by_the_closed_form(rig: Rig, parts: dict[str, Part]) -> None:
    pressed = 1e-4
    damper, place = rig.damper, placements(rig)["damper_right"]
    higher = Placement(shift=place.shift + np.array([0, 0, pressed])).part(damper_part(damper), "damper_right")
    result = overlaps({**parts, "damper_right": higher})

    def lens(along: float) -> float:
        r, big = damper.end_radius + 0.15 * along, rig.blade.groove_radius + 0.15 * along
        d = big - r + pressed
        one, other = (d * d + r * r - big * big) / (2 * d * r), (d * d + big * big - r * r) / (2 * d * big)
        kite = sqrt((r + big - d) * (d + r - big) * (d - r + big) * (d + r + big)) / 2
        # What of the damper's circle lies outside the groove's.
        return np.pi * r * r - (r * r * acos(one) + big * big * acos(other) - kite)

    expected, _ = quad(lens, 0.0, damper.contact_length)
    # The slope is 0.15 within 1e-4; tan 8.53 deg = 0.14999.
    assert result == pytest.approx(
        {("blade", "damper_right"): expected, ("damper_right", "decoupler_right"): expected}, rel=1e-3
    )
    with pytest.raises(
        GeometryError, match=r"bodies overlap: blade and damper_right by 2\.\d+ mm\^3; damper_right and"
    ):
        check_no_overlap({**parts, "damper_right": higher})


def test_one_micrometre_of_overlap_is_found(rig: Rig, parts: dict[str, Part]) -> None:
    place = placements(rig)["damper_right"]
    higher = Placement(shift=place.shift + np.array([0, 0, 1e-6])).part(damper_part(rig.damper), "damper_right")
    assert set(overlaps({**parts, "damper_right": higher})) == {
        ("blade", "damper_right"), ("damper_right", "decoupler_right")
    }  # fmt: skip


def test_named_points_lie_on_their_bodies(rig: Rig, parts: dict[str, Part]) -> None:
    import cadquery as cq

    points = named_points(rig)
    assert set(points) == set(BODIES)
    assert set(points["blade"]) == {"excitation", "response", "laser_left", "laser_right"}
    for body, named in points.items():
        for point in named.values():
            vertex = cq.Vertex.makeVertex(*(MILLIMETRES_PER_METRE * point))
            assert min(face.distance(vertex) for face in parts[body].solid.Faces()) < 1e-9
    # What the laser compares lies on one side, a damper's radius and the lips of the pad apart.
    for side in ("left", "right"):
        across = points["blade"][f"laser_{side}"] - points[f"damper_{side}"]["laser_blade"]
        assert across[0] > 0
        assert abs(across[1]) == pytest.approx(rig.damper.shoulder, rel=1e-9)


def test_the_step_file_holds_five_named_bodies(parts: dict[str, Part], tmp_path: Path) -> None:
    import cadquery as cq

    path = tmp_path / "rig.step"
    write_assembly_step("rig", parts, path)
    read = cq.Assembly.importStep(str(path))
    volumes = {
        node.name: Part(name=node.name, solid=node.obj).volume for node in read.objects.values() if node.obj is not None
    }
    assert volumes == pytest.approx({name: part.volume for name, part in parts.items()}, rel=1e-9)


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        ({"damper": Damper(cone_half_angle=radians(8.0))},
         r"the rig cannot be built: cone_half_angle = 8 deg of the damper is not that of the blade, 8\.53 deg, so "
         r"that they separate by 113 um along the line \(give all bodies the same\); cone_half_angle = 8 deg .*"
         r" decoupler"),
        ({"decoupler": Decoupler(contact_length=0.010)},
         r"contact_length = 12 mm of the damper is not that of the decoupler, 10 mm"),
        ({"blade": Blade(groove_radius=0.004)}, r"groove_radius = 4 mm of the blade is too narrow for the damper end"),
        ({"excitation_radius": 0.012}, r"excitation_radius = 12 mm is not between .* and 11 mm, .* = 20 mm"),
        ({"excitation_radius": 0.0}, r"excitation_radius = 0 mm is not between"),
        ({"blade": Blade(excitation_height=0.003)}, r"excitation_radius = 5 mm is not between .* and 3 mm"),
    ],
)  # fmt: skip
def test_bodies_that_do_not_fit_are_refused_in_one_sentence(bodies: dict[str, object], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        replace(Rig(), **bodies)  # type: ignore[arg-type]
