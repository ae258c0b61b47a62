"""Contact elements of two coincident lines, one per station."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Float, Int

from geometry.interface import ContactLine
from reduction.array_type import Real, Whole
from reduction.errors import JointError
from reduction.jointed_system import Friction, FrictionContact

#: Rows over all coordinates: the normal (closing is positive), and the two tangents.
Directions = Float[Real, "station 3 r"]


class Tangents(Enum):
    """Tangents in which a contact slides."""

    ALONG = "along"
    """Along the line, in the plane of vibration; the second tangent has a spring k_t."""
    BOTH = "both"
    """Both tangents."""


@dataclass(frozen=True, kw_only=True)
class LineStiffness:
    """Contact stiffness of a line, distributed over its stations by their tributary lengths.

    Raises
    ------
    JointError
        A stiffness that is not positive.
    """

    normal: float
    tangential: float
    """Stiffnesses k_n and k_t of the whole line [N/m]."""

    def __post_init__(self) -> None:
        for name, value in (("normal", self.normal), ("tangential", self.tangential)):
            if not (np.isfinite(value) and value > 0):
                raise JointError(f"the {name} stiffness of a contact line is {value:g} N/m: give a positive number")


def make_contact_directions(
    n_dof: int, line: ContactLine, rows: Int[Whole, "station 3"], other_rows: Int[Whole, "station 3"]
) -> Directions:
    """Relative displacements of two bodies at the stations of a line.

    Parameters
    ----------
    n_dof
        Number of coordinates of the whole model, r [-].
    line
        Line of the first body; its normals point into the second body.
    rows, other_rows
        Coordinates of x, y, z at each station of the first and of the second body, shape (n_station, 3) [-].

    Returns
    -------
    Rows of each station for the approach along the normal, and for the motion of the first body relative to the second
    along the two tangents, shape (n_station, 3, r) [-].
    """
    result = np.zeros((line.n_station, 3, n_dof))
    frames = np.concatenate([line.normal[:, None, :], line.tangents], axis=1)
    for station, frame in enumerate(frames):
        result[station][:, rows[station]] += frame
        result[station][:, other_rows[station]] -= frame
    return np.asarray(result)


def compute_station_stiffness(line: ContactLine, stiffness: LineStiffness) -> Float[Real, "station 2"]:
    """Stiffnesses k_n and k_t of each station, proportional to its tributary length, shape (n_station, 2) [N/m]."""
    share = line.tributary_length / line.tributary_length.sum()
    return np.outer(share, [stiffness.normal, stiffness.tangential])


def make_line_contacts(
    name: str,
    line: ContactLine,
    directions: Directions,
    stiffness: LineStiffness,
    friction_coefficient: float,
    *,
    tangents: Tangents = Tangents.ALONG,
    gaps: Sequence[float] | Float[Real, " station"] | None = None,
) -> list[FrictionContact]:
    """Contact elements of a line of a pair of bodies, named "name.1" and so on along the line.

    With `Tangents.ALONG` the second tangent does not slide; `make_fixed_tangent_stiffness` gives its springs. Two
    sliding tangents are coupled by Coulomb's law.

    Parameters
    ----------
    name
        Name of the pair of bodies.
    line
        The line.
    directions
        Result of `make_contact_directions`, shape (n_station, 3, r) [-].
    stiffness
        Stiffness of the line.
    friction_coefficient
        Friction coefficient mu [-].
    tangents
        Tangents in which the stations slide.
    gaps
        Initial gap at each station, shape (n_station,) [m]; none by default.

    Raises
    ------
    JointError
        Gaps that are not one per station.
    """
    opening = np.zeros(line.n_station) if gaps is None else np.asarray(gaps, dtype=np.float64)
    if opening.shape != (line.n_station,):
        raise JointError(
            f'contact line "{name}" has {line.n_station} stations but gaps of shape {opening.shape}: give one per '
            "station"
        )
    sliding = slice(1, 2) if tangents is Tangents.ALONG else slice(1, 3)
    return [
        FrictionContact(
            name=f"{name}.{station + 1}",
            normal=rows[0],
            tangents=rows[sliding],
            normal_stiffness=float(k_n),
            tangential_stiffness=float(k_t),
            friction_coefficient=friction_coefficient,
            gap=float(opening[station]),
            friction=Friction.UNCOUPLED if tangents is Tangents.ALONG else Friction.COULOMB,
        )
        for station, (rows, (k_n, k_t)) in enumerate(
            zip(directions, compute_station_stiffness(line, stiffness), strict=True)
        )
    ]


def make_fixed_tangent_stiffness(
    line: ContactLine, directions: Directions, stiffness: LineStiffness
) -> Float[Real, "r r"]:
    """Stiffness of the springs k_t of the second tangent for `Tangents.ALONG`, shape (r, r) [N/m]."""
    k_t = compute_station_stiffness(line, stiffness)[:, 1]
    across = directions[:, 2]
    return np.asarray(across.T @ (k_t[:, None] * across))
