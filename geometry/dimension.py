"""The range in which a dimension can be built, and the one sentence that says what is wrong with a set of them."""

from collections.abc import Container, Iterable, Mapping
from math import degrees, isfinite, radians
from typing import NoReturn

from geometry.errors import GeometryError

# A hundredth of a millimetre is a hundred times finer than a rig's tolerances and still a hundred thousand times
# coarser than the CAD kernel's own (1e-7 mm): what is thinner than this is a slip of the unit, as is ten metres.
SMALLEST = 1e-5
LARGEST = 10.0
# A flatter cone is replaced by a cylinder in the CAD kernel (seen below 0.01 deg), which moves the contact line.
FLATTEST_CONE = radians(0.05)
STEEPEST_CONE = radians(45.0)


def in_millimetres(length: float) -> str:
    """A length [m] as a reader of drawings expects it."""
    return f"{1e3 * length:.6g} mm"


def range_problems(dimensions: Mapping[str, float]) -> dict[str, str]:
    """What is wrong with single dimensions, by name; sound ones are left out.

    Parameters
    ----------
    dimensions
        Lengths by the name of their field [m].

    Returns
    -------
    One clause for each dimension that is not finite, not positive or outside [`SMALLEST`, `LARGEST`].
    """
    remedy = f"in Python give metres between {SMALLEST:g} and {LARGEST:g}"
    problems = {}
    for name, value in dimensions.items():
        said = f"{name} = {in_millimetres(value)}"
        if not isfinite(value):
            problems[name] = f"{said} is not finite ({remedy})"
        elif value <= 0:
            problems[name] = f"{said} is not positive ({remedy})"
        elif value < SMALLEST:
            problems[name] = f"{said} is thinner than can be made ({remedy})"
        elif value > LARGEST:
            problems[name] = f"{said} is longer than any rig ({remedy})"
    return problems


def cone_angle_problems(angles: Mapping[str, float]) -> dict[str, str]:
    """What is wrong with half-angles of cones [rad], by name; sound ones are left out."""
    return {
        name: f"{name} = {degrees(angle):.6g} deg is not between 0.05 and 45 deg (in Python give radians)"
        for name, angle in angles.items()
        if not (isfinite(angle) and FLATTEST_CONE <= angle < STEEPEST_CONE)
    }


def order_problems(
    dimensions: Mapping[str, float], at_most: Iterable[tuple[str, str]], *, unsound: Container[str]
) -> list[str]:
    """What is wrong with pairs of dimensions of which the first must not exceed the second.

    Parameters
    ----------
    dimensions
        Lengths by the name of their field [m].
    at_most
        Names of the smaller and the larger.
    unsound
        Names of dimensions that are out of range themselves: pairs with one of them are passed over.
    """
    return [
        f"{smaller} = {in_millimetres(dimensions[smaller])} exceeds {larger} = {in_millimetres(dimensions[larger])} "
        "(lower the one or raise the other)"
        for smaller, larger in at_most
        if smaller not in unsound and larger not in unsound and dimensions[smaller] > dimensions[larger]
    ]


def raise_geometry_error(body: str, problems: Iterable[str]) -> NoReturn:
    """Refuse a body with all that is wrong with it, in one sentence.

    Raises
    ------
    GeometryError
        Always.
    """
    raise GeometryError(f"the {body} cannot be built: {'; '.join(problems)}")
