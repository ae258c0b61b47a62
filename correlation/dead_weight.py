"""Dead weights that press contact lines, and the wires that they hang on."""

from dataclasses import dataclass
from math import cos, sin

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.read_only_array import freeze_fields

Row = Float[NDArray[np.float64], " r"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Wire:
    r"""A wire that pulls a body up: its load is :math:`F (\sin i\, h + \cos i\, (v + s\, m))`.

    Parameters
    ----------
    force
        F [N].
    shift
        s, distance of the wire from where it should lie [m].
    inclination
        i, angle of the wire to the vertical [rad].
    horizontal, vertical
        h and v, loads of a unit force, shape (r,) [-].
    moment
        m, change of the load of a vertical unit force per metre of shift, shape (r,) [1/m].
    """

    force: float
    shift: float
    inclination: float
    horizontal: Row
    vertical: Row
    moment: Row

    def __post_init__(self) -> None:
        freeze_fields(self, "horizontal", "vertical", "moment")

    @property
    def load(self) -> Row:
        """Over the degrees of freedom, shape (r,) [N]."""
        upright = self.vertical + self.shift * self.moment
        return self.force * (sin(self.inclination) * self.horizontal + cos(self.inclination) * upright)


@dataclass(frozen=True, kw_only=True, eq=False)
class DeadWeight:
    """A constant load that presses contact lines, which have their preloads from it.

    Parameters
    ----------
    row
        The load over the degrees of freedom, shape (r,) [N].
    lines
        Lines that it presses; they have no other preload.
    wire
        The wire that it hangs on, with the same load; None if its possible shifts are unknown.
    """

    row: Row
    lines: tuple[str, ...]
    wire: Wire | None = None

    def __post_init__(self) -> None:
        freeze_fields(self, "row")

    @classmethod
    def on_wire(cls, wire: Wire, lines: tuple[str, ...]) -> "DeadWeight":
        """A dead weight that hangs on a wire."""
        return cls(row=wire.load, lines=lines, wire=wire)
