"""CAD model of the rig's blade: block, plate and two grooved pads fused into one solid, with named faces."""

import numpy as np

from geometry.blade import Blade, contact_lines
from geometry.blade_points import named_points
from geometry.part import FaceRegion, Part, Shape
from geometry.solid import Section, block, cone_along_y, curved_faces, face_region, plane_faces, prism, single_solid


def blade_part(blade: Blade) -> Part:
    """Build the blade as one solid with named faces, points and contact lines.

    Returns
    -------
    Part with the faces "clamp" (the root block's two faces normal to y), "root_bottom", "tip", and on the side of +y
    and -y "groove_positive", "groove_negative" (only the cone) and "pad_positive", "pad_negative" (outer faces).

    Raises
    ------
    GeometryError
        The dimensions give no single valid solid.
    """
    solid = blade_solid(blade)
    return Part(
        name="blade",
        solid=solid,
        faces=blade_faces(blade, solid),
        points=named_points(blade),
        contact_lines=contact_lines(blade),
    )


def blade_section(blade: Blade) -> Section:
    """Outline (x, y) of the plate, counter-clockwise [m]."""
    edge, flat = blade.chord / 2, blade.flat_width / 2
    thin, thick = blade.edge_thickness / 2, blade.thickness / 2
    lower = [(-edge, -thin), (-flat, -thick), (flat, -thick), (edge, -thin)]
    return [*lower, *((-x, -y) for x, y in lower)]


def grooved_pad(blade: Blade) -> Shape:
    """Pad on the face at +y with its groove."""
    face, half_width = blade.thickness / 2, blade.flat_width / 2
    pad = block((-half_width, face, blade.pad_bottom), (half_width, blade.pad_face, blade.pad_top))
    # The cutter extends beyond the pad, so that no faces of the two coincide where the groove is open.
    past = blade.pad_face + blade.contact_length / 10
    (end_radius,) = blade.groove_radius_at(np.array([past]))
    cutter = cone_along_y(
        start=face,
        end=past,
        start_radius=blade.narrow_groove_radius,
        end_radius=float(end_radius),
        axis_height=blade.groove_axis,
    )
    return pad.cut(cutter)


def blade_solid(blade: Blade) -> Shape:
    """Blade as one CadQuery solid, in millimetres.

    Raises
    ------
    GeometryError
        The dimensions give no single valid solid.
    """
    x, y = blade.root_chord / 2, blade.root_thickness / 2
    root = block((-x, -y, -blade.root_height), (x, y, 0.0))
    pad = grooved_pad(blade)
    # Not simplified after the union: merging faces would remove the crest of each groove, which is an edge.
    return single_solid("blade", prism(blade_section(blade), blade.length).fuse(root, pad, pad.mirror("XZ")))


def blade_faces(blade: Blade, solid: Shape) -> dict[str, FaceRegion]:
    """Named faces of the blade's solid; see `blade_part`."""
    half_root = blade.root_thickness / 2
    result = {
        # A face of a pad can be in the same plane as a face of the root block: their heights distinguish them.
        "clamp": (
            *plane_faces(solid, normal=(0, 1, 0), offset=half_root, where=lambda centre: centre[2] < 0),
            *plane_faces(solid, normal=(0, -1, 0), offset=half_root, where=lambda centre: centre[2] < 0),
        ),
        "root_bottom": plane_faces(solid, normal=(0, 0, -1), offset=blade.root_height),
        "tip": plane_faces(solid, normal=(0, 0, 1), offset=blade.length),
        "groove_positive": curved_faces(solid, where=lambda centre: centre[1] > 0),
        "groove_negative": curved_faces(solid, where=lambda centre: centre[1] < 0),
        "pad_positive": plane_faces(solid, normal=(0, 1, 0), offset=blade.pad_face, where=lambda centre: centre[2] > 0),
        "pad_negative": plane_faces(
            solid, normal=(0, -1, 0), offset=blade.pad_face, where=lambda centre: centre[2] > 0
        ),
    }
    return {name: face_region(name, faces) for name, faces in result.items()}
