"""Numbers of elements: the meshing rule of the blades, and checks of the numbers of elements of a body."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil, isfinite

from fe.element import Element
from fe.errors import MeshError

#: Tolerance so that round-off adds no element to a length that is a whole number of elements [-].
COUNT_GUARD = 1e-9
#: Smallest step between two faces for which cells are made [m].
SMALLEST_STEP = 1e-8


@dataclass(frozen=True, kw_only=True)
class MeshRule:
    """Element size h = min(a t / n, c), with the thickness t and the number n of elements through it.

    Parameters
    ----------
    element
        The element.
    through_thickness
        Number of elements n through the thickness, at least 1 [-].
    length_ratio
        Ratio a of element length to element thickness [-]. Parasitic shear of the 8-node brick depends on the length of
        the element, so a determines the error of its frequencies.
    length_cap
        Largest element length c [m].
    subdivisions
        Number of parts into which each element of the rule is divided along each edge [-]: 1, 2, 4, ... give nested
        meshes.

    Raises
    ------
    MeshError
        A count below one, or a ratio or cap that is not positive.
    """

    element: Element
    through_thickness: int
    length_ratio: float
    length_cap: float
    subdivisions: int = 1

    def __post_init__(self) -> None:
        if self.through_thickness < 1:
            raise MeshError(f"elements_through_thickness = {self.through_thickness}: give at least 1")
        if self.subdivisions < 1:
            raise MeshError(f"subdivisions = {self.subdivisions}: give at least 1")
        if not (isfinite(self.length_ratio) and self.length_ratio > 0):
            raise MeshError(f"length_ratio = {self.length_ratio:g} must be positive: 2.4 is a usual value")
        if not (isfinite(self.length_cap) and self.length_cap > 0):
            raise MeshError(f"length_cap = {self.length_cap * 1e3:g} mm must be positive: 8 mm is a usual value")

    def size(self, thickness: float) -> float:
        """Element length h for a blade of the given thickness [m]."""
        return min(self.length_ratio * thickness / self.through_thickness, self.length_cap)


def count_elements(length: float, size: float) -> int:
    """Number of elements of at most `size` that fill `length`, at least one [-]."""
    return max(1, ceil(length / size - COUNT_GUARD))


def check_counts(body: str, counts: Mapping[str, int], *, even: Iterable[str] = (), why_even: str = "") -> None:
    """Refuse invalid numbers of elements.

    Parameters
    ----------
    body
        Name of the body, for the message.
    counts
        Numbers of elements by the name of their field [-].
    even
        Fields that must be even.
    why_even
        "so that ...", for the message.

    Raises
    ------
    MeshError
        A number below 1, or an odd number that must be even.
    """
    for name, value in counts.items():
        if value < 1:
            raise MeshError(f"{body}: {name} = {value} elements: give at least 1")
    for name in even:
        if counts[name] % 2:
            raise MeshError(f"{body}: {name} = {counts[name]} elements: give an even number, {why_even}")
