"""The plain blade: two blocks, so that every volume, area and centre is exact."""

from dataclasses import fields
from math import inf, nan

import numpy as np
import pytest

from geometry.errors import GeometryError
from geometry.plain_blade import PlainBlade, plain_blade_part

# Planes only: the kernel's quadrature is exact, round-off of sums of products remains.
EXACT = 1e-13
PLACE = 1e-15


@pytest.mark.parametrize(
    ("dimensions", "message"),
    [
        ({"length": -0.2}, r"the plain blade cannot be built: length = -200 mm is not positive"),
        ({"chord": 0.03, "root_chord": 0.02}, r"chord = 30 mm exceeds root_chord = 20 mm"),
        ({"thickness": 0.02, "root_thickness": 0.01}, r"thickness = 20 mm exceeds root_thickness = 10 mm"),
        ({"length": 0.2, "excitation_height": 0.2}, r"excitation_height = 200 mm is not below the tip .* 200 mm"),
    ],
)
def test_a_plain_blade_that_cannot_be_built_is_refused_with_the_value(
    dimensions: dict[str, float], message: str
) -> None:
    with pytest.raises(GeometryError, match=message):
        PlainBlade(**dimensions)


@pytest.mark.parametrize("name", [field.name for field in fields(PlainBlade)])
@pytest.mark.parametrize("value", [-1.0, 0.0, nan, inf, 1e-6, 1e3])
def test_every_dimension_is_checked(name: str, value: float) -> None:
    with pytest.raises(GeometryError, match=f"{name} = "):
        PlainBlade(**{name: value})


@pytest.mark.parametrize(
    "blade",
    [
        PlainBlade(),
        PlainBlade(chord=0.03, root_chord=0.03, thickness=0.008, root_thickness=0.008),
        PlainBlade(chord=0.02, root_chord=0.03, thickness=0.008, root_thickness=0.02),
    ],
    ids=["default", "flush", "stepped"],
)
def test_volume_areas_and_centres_are_exact(blade: PlainBlade) -> None:
    part = plain_blade_part(blade)
    root = blade.root_chord * blade.root_thickness * blade.root_height
    np.testing.assert_allclose(part.volume, blade.length * blade.chord * blade.thickness + root, rtol=EXACT)
    expected = {
        "clamp": (2 * blade.root_chord * blade.root_height, -blade.root_height / 2),
        "root_bottom": (blade.root_chord * blade.root_thickness, -blade.root_height),
        "tip": (blade.chord * blade.thickness, blade.length),
    }
    assert part.faces.keys() == expected.keys()
    for name, (area, height) in expected.items():
        np.testing.assert_allclose(part.faces[name].area, area, rtol=EXACT)
        np.testing.assert_allclose(part.faces[name].centre, [0, 0, height], atol=PLACE)
    assert part.solid.isValid()


def test_it_has_points_but_nothing_to_touch() -> None:
    blade = PlainBlade()
    part = plain_blade_part(blade)
    np.testing.assert_array_equal(part.points["excitation"], [0, blade.thickness / 2, blade.excitation_height])
    np.testing.assert_array_equal(part.points["response"], [0, blade.thickness / 2, blade.length])
    assert not part.contact_lines
