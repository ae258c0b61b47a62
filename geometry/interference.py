"""Check whether bodies of an assembly overlap."""

from collections.abc import Mapping
from itertools import combinations

from geometry.errors import GeometryError
from geometry.part import MILLIMETRES_PER_METRE, Part

# Largest volume that is not an overlap [m^3]. A damper pressed 1 um into its groove overlaps it in a sliver of 12 mm by
# 0.3 mm by 2/3 of 1 um, 2.5e-12 m^3, which is detected; for surfaces that only touch, the kernel finds no volume.
NO_OVERLAP = 1e-12


def overlaps(parts: Mapping[str, Part]) -> dict[tuple[str, str], float]:
    """Common volumes of pairs of bodies by their names, without pairs that do not overlap [m^3]."""
    result = {}
    for one, other in combinations(parts, 2):
        if _boxes_apart(parts[one], parts[other]):
            continue
        common = parts[one].solid.intersect(parts[other].solid)
        volume = sum(float(solid.Volume()) for solid in common.Solids()) / MILLIMETRES_PER_METRE**3
        if volume > NO_OVERLAP:
            result[one, other] = volume
    return result


def check_no_overlap(parts: Mapping[str, Part]) -> None:
    """Refuse an assembly whose bodies overlap.

    Raises
    ------
    GeometryError
        Overlapping bodies; the message lists all pairs and volumes.
    """
    result = overlaps(parts)
    if result:
        pairs = "; ".join(f"{one} and {other} by {1e9 * volume:.3g} mm^3" for (one, other), volume in result.items())
        raise GeometryError(f"bodies overlap: {pairs}: move them apart or change the dimensions where they meet")


def _boxes_apart(one: Part, other: Part) -> bool:
    a, b = one.bounding_box, other.bounding_box
    return bool((a[0] > b[1]).any() or (b[0] > a[1]).any())
