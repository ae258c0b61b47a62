"""Contact lines of a body: stations, their frames and tributary lengths."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import GeometryError
from geometry.read_only_array import freeze_fields

# The paper places seven contact elements on each contact line.
N_STATION = 7

Stations = Float[NDArray[np.float64], "station 3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactLine:
    """Line on the surface of a body along which it may touch another body; arrays are copied and read-only.

    Parameters
    ----------
    name
        Name of the line in meshes, reduced models and result files.
    stations
        Points of the line in order, ends included, shape (n_station, 3) [m].
    normal
        Outward unit normals of the body, shape (n_station, 3) [-].
    tangents
        Two unit vectors in the surface, the first along the line, shape (n_station, 2, 3) [-].
    tributary_length
        Length of the line that belongs to each station; the sum is the length of the line, shape (n_station,) [m].

    Raises
    ------
    GeometryError
        The arrays do not describe the same number of stations.
    """

    name: str
    stations: Stations
    normal: Stations
    tangents: Float[NDArray[np.float64], "station 2 3"]
    tributary_length: Float[NDArray[np.float64], " station"]

    def __post_init__(self) -> None:
        freeze_fields(self, "stations", "normal", "tangents", "tributary_length", order="C")
        n_station = len(self.stations)
        expected = {"normal": (n_station, 3), "tangents": (n_station, 2, 3), "tributary_length": (n_station,)}
        for name, shape in expected.items():
            actual = getattr(self, name).shape
            if actual != shape:
                raise GeometryError(
                    f'contact line "{self.name}" has {n_station} stations but {name} of shape {actual}: give {shape}'
                )

    @property
    def n_station(self) -> int:
        """Number of stations [-]."""
        return len(self.stations)


def straight_contact_line(
    *,
    name: str,
    start: Float[NDArray[np.float64], " 3"],
    end: Float[NDArray[np.float64], " 3"],
    normal: Float[NDArray[np.float64], " 3"],
    across: Float[NDArray[np.float64], " 3"],
    n_station: int = N_STATION,
) -> ContactLine:
    r"""Evenly spaced stations on a straight line, with the trapezoidal rule's weights as tributary lengths.

    .. math:: \ell_i = \frac{|b - a|}{n - 1} \cdot \begin{cases} 1/2 & i \in \{1, n\} \\ 1 & \text{else} \end{cases}

    Parameters
    ----------
    name
        Name of the line.
    start, end
        First and last station, shape (3,) [m].
    normal
        Outward unit normal of the body, shape (3,) [-].
    across
        Unit vector in the surface, perpendicular to the line, shape (3,) [-].
    n_station
        Number of stations, ends included [-].

    Raises
    ------
    GeometryError
        Fewer than two stations; both ends of the line are stations.
    """
    if n_station < 2:
        raise GeometryError(f'contact line "{name}" cannot have {n_station} stations: give 2 or more')
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    weights = np.full(n_station, length / (n_station - 1))
    weights[[0, -1]] /= 2
    return ContactLine(
        name=name,
        stations=start + np.linspace(0.0, 1.0, n_station)[:, None] * (end - start),
        normal=np.tile(normal, (n_station, 1)),
        tangents=np.tile(np.stack([along, across]), (n_station, 1, 1)),
        tributary_length=weights,
    )
