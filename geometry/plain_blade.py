"""Plain blade: a uniform rectangular bar on a root block, without pads or contact."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from geometry.blade_points import named_points as named_points
from geometry.dimension import SMALLEST, check_dimensions, in_millimetres
from geometry.part import Part


@dataclass(frozen=True, kw_only=True)
class PlainBlade:
    """Dimensions of the plain blade [m]. Axes as in `geometry.blade.Blade`.

    The paper publishes no dimensions. They are chosen here so that the first frequency is 122.25 Hz and the second
    above twice the first. It is the simplest body whose mesh study agrees with the published one, and its volumes,
    areas and first frequency can be checked by hand.

    Parameters
    ----------
    length
        Length from root block to tip. It was searched, together with the root block, so that the mesh study of Table 1
        is reproduced.
    thickness
        Thickness in the direction of vibration. With the length it determines the first frequency (proportional to
        thickness / length^2).
    chord
        Width: four thicknesses, so that edgewise bending is four times as high as the first mode.
    root_chord, root_thickness, root_height
        Dimensions of the root block, as wide as the blade. Thickness and height were searched, together with the
        length, so that the mesh study of Table 1 is reproduced; its two faces normal to y are clamped, and the
        compliance of the metal between them lowers the frequency.
    excitation_height
        Height z of the point where the stinger of the shaker acts: near the root, where the blade moves least and is
        least affected by the shaker.

    Raises
    ------
    GeometryError
        Dimensions out of range or in conflict; the message lists all with values and remedy.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), Table 1.
    """

    length: float = 0.2016
    thickness: float = 0.006
    chord: float = 0.024
    root_chord: float = 0.024
    root_thickness: float = 0.012
    root_height: float = 0.020
    excitation_height: float = 0.020

    def __post_init__(self) -> None:
        at_most = [("chord", "root_chord"), ("thickness", "root_thickness")]
        check_dimensions("plain blade", self, at_most=at_most, angles={}, further=self._excitation_problems)

    def _excitation_problems(self, invalid: Collection[str]) -> Iterator[str]:
        names = {"excitation_height", "length"}
        if names.isdisjoint(invalid) and self.excitation_height > self.length - SMALLEST:
            yield (
                f"excitation_height = {in_millimetres(self.excitation_height)} is not below the tip at length = "
                f"{in_millimetres(self.length)} (lower it)"
            )


def plain_blade_part(blade: PlainBlade) -> Part:
    """Build the plain blade as one solid with the faces "clamp", "root_bottom" and "tip" and its named points.

    Raises
    ------
    GeometryError
        The dimensions give no single valid solid.
    """
    from geometry.solid import block, face_region, plane_faces, single_solid

    half_chord, half_thickness, half_root = blade.chord / 2, blade.thickness / 2, blade.root_thickness / 2
    plate = block((-half_chord, -half_thickness, 0.0), (half_chord, half_thickness, blade.length))
    root = block((-blade.root_chord / 2, -half_root, -blade.root_height), (blade.root_chord / 2, half_root, 0.0))
    # Not simplified after the union: the clamped faces of a block as thick as the plate would merge with the plate's.
    solid = single_solid("plain blade", plate.fuse(root))
    result = {
        "clamp": (
            *plane_faces(solid, normal=(0, 1, 0), offset=half_root, where=lambda centre: centre[2] < 0),
            *plane_faces(solid, normal=(0, -1, 0), offset=half_root, where=lambda centre: centre[2] < 0),
        ),
        "root_bottom": plane_faces(solid, normal=(0, 0, -1), offset=blade.root_height),
        "tip": plane_faces(solid, normal=(0, 0, 1), offset=blade.length),
    }
    faces = {name: face_region(name, region) for name, region in result.items()}
    return Part(name="plain_blade", solid=solid, faces=faces, points=named_points(blade))
