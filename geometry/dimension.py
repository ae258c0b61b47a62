"""Check dimensions: allowed ranges, and one message with all problems of a set of dimensions."""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict
from math import degrees, isfinite, nextafter, radians
from typing import Any

from geometry.errors import GeometryError

# Smallest and largest length [m]; other values are probably in a wrong unit. A hundredth of a millimetre is a hundred
# times finer than the tolerances of a rig, and a hundred thousand times coarser than those of the CAD kernel (1e-7 mm).
SMALLEST = 1e-5
LARGEST = 10.0
# Range of the half-angle of cones [rad]. The CAD kernel replaces flatter cones by cylinders (observed below 0.01 deg),
# which moves the contact line.
CONE = {"cone_half_angle": (radians(0.05), nextafter(radians(45.0), 0.0))}


def in_millimetres(length: float) -> str:
    """Length [m] as text in millimetres, as in drawings."""
    return f"{1e3 * length:.6g} mm"


def check_dimensions(
    body: str,
    dimensions: Any,
    *,
    at_most: Iterable[tuple[str, str]] = (),
    angles: Mapping[str, tuple[float, float]] = CONE,
    further: Callable[[Collection[str]], Iterable[str]],
) -> None:
    """Refuse a body with invalid dimensions; the message lists all problems in one sentence.

    Parameters
    ----------
    body
        Name of the body in the message.
    dimensions
        Dataclass whose fields are lengths [m], except for the angles.
    at_most
        Names of pairs of lengths of which the first must not exceed the second.
    angles
        Names of fields that are angles, and the range of each [rad].
    further
        Function that gets the names of invalid dimensions and returns clauses about conflicts of valid dimensions.

    Raises
    ------
    GeometryError
        A length that is not finite, not positive or outside [`SMALLEST`, `LARGEST`], an angle out of its range, a pair
        in the wrong order, or a problem from `further`.
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
        The problems, in one sentence.
    """
    clauses = "; ".join(problems)
    if clauses:
        raise GeometryError(f"the {body} cannot be built: {clauses}")
