"""The range in which a dimension can be built, and the one sentence that says what is wrong with a set of them."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict
from math import degrees, isfinite, nextafter, radians
from typing import Any

from geometry.errors import GeometryError

# A hundredth of a millimetre is a hundred times finer than a rig's tolerances and still a hundred thousand times
# coarser than the CAD kernel's own (1e-7 mm): what is thinner than this is a slip of the unit, as is ten metres.
SMALLEST = 1e-5
LARGEST = 10.0
# A flatter cone is replaced by a cylinder in the CAD kernel (seen below 0.01 deg), which moves the contact line.
CONE = {"cone_half_angle": (radians(0.05), nextafter(radians(45.0), 0.0))}


def in_millimetres(length: float) -> str:
    """A length [m] as a reader of drawings expects it."""
    return f"{1e3 * length:.6g} mm"


def check_dimensions(
    body: str,
    dimensions: Any,
    *,
    at_most: Iterable[tuple[str, str]] = (),
    angles: Mapping[str, tuple[float, float]] = CONE,
    further: Callable[[Collection[str]], Iterable[str]],
) -> None:
    """Refuse a body with all that is wrong with its dimensions, in one sentence.

    Parameters
    ----------
    body
        Name for the message.
    dimensions
        Dataclass whose fields are lengths [m], but for the angles.
    at_most
        Names of pairs of lengths of which the first must not exceed the second.
    angles
        Names of fields that are angles, and the range of each [rad].
    further
        Clauses on what is wrong with valid dimensions together, from the names of those that are invalid.

    Raises
    ------
    GeometryError
        A length that is not finite, not positive or outside [`SMALLEST`, `LARGEST`], an angle out of its range, a pair
        in the wrong order, or what `further` finds.
    """
    values: dict[str, float] = asdict(dimensions)
    problems = {
        name: _describe_angle_problem(name, value, *angles[name])
        if name in angles
        else _describe_length_problem(name, value)
        for name, value in sorted(values.items(), key=lambda item: item[0] in angles)
    }
    invalid = {name for name, problem in problems.items() if problem}
    clauses = [problem for problem in problems.values() if problem]
    clauses += [
        f"{smaller} = {in_millimetres(values[smaller])} exceeds {larger} = {in_millimetres(values[larger])} "
        "(lower the one or raise the other)"
        for smaller, larger in at_most
        if invalid.isdisjoint((smaller, larger)) and values[smaller] > values[larger]
    ]
    refuse(body, [*clauses, *further(invalid)])


def _describe_length_problem(name: str, value: float) -> str:
    if not isfinite(value):
        problem = "is not finite"
    elif value <= 0:
        problem = "is not positive"
    elif value < SMALLEST:
        problem = "is thinner than can be made"
    elif value > LARGEST:
        problem = "is longer than any rig"
    else:
        return ""
    return f"{name} = {in_millimetres(value)} {problem} (in Python give metres between {SMALLEST:g} and {LARGEST:g})"


def _describe_angle_problem(name: str, angle: float, least: float, most: float) -> str:
    if isfinite(angle) and least <= angle <= most:
        return ""
    between = f"{degrees(least):.6g} and {degrees(most):.6g} deg"
    return f"{name} = {degrees(angle):.6g} deg is not between {between} (in Python give radians)"


def refuse(body: str, problems: Iterable[str]) -> None:
    """Refuse a body if there are problems.

    Raises
    ------
    GeometryError
        One sentence with all of them.
    """
    clauses = "; ".join(problems)
    if clauses:
        raise GeometryError(f"the {body} cannot be built: {clauses}")
