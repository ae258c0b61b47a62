"""What a kind of case makes of its ``[structure]``: matrices, and what is known of their degrees of freedom."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.model import DeadWeight, Dof, LineSensor, Part, Sensor
from reduction.file.structure_file import StructureMatrices
from reduction.joint.law import Joint
from reduction.stuck import stuck_stiffness

Row = Float[NDArray[np.float64], " r"]
Matrix = Float[NDArray[np.float64], "r r"]
#: Slider positions at which a curve begins [m], one row per friction history.
Histories = Callable[[int, int], list[Row]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Structure:
    """A structure before a case puts joints, loads and sensors on it.

    Parameters
    ----------
    matrices
        Mass, damping and stiffness of r degrees of freedom, and the reduced model if they come from one.
    dofs
        What each degree of freedom is; unknown if empty.
    parts
        Named shares of mass and stiffness; none if they are not known.
    stored
        Rows that a case may name, shape (r,) or (n, r).
    places
        Points with a direction that the kind names itself.
    joints, lines
        Joints that belong to the structure, and those of each contact line by name.
    static_load
        That balances these joints at rest, shape (r,) [N]; none if empty.
    harmonic_force
        At level 1, shape (n, r) [N]; None where the case must say it.
    sensors
        What a response shows if the case names no sensor.
    dead_weights
        What presses lines.
    suspension
        Stiffness that holds the structure when its contacts are taken away for a test, shape (r, r) [N/m].
    damped
        Damping matrix with all joints of the case [N s/m]; None keeps that of `matrices`.
    histories
        Draws slider positions for a number of friction histories by a seed; None where rest is not known.
    details
        What the kind needs again for its own tables and figures.
    """

    matrices: StructureMatrices
    dofs: tuple[Dof, ...] = ()
    parts: tuple[Part, ...] = ()
    stored: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    places: Mapping[str, Row] = field(default_factory=dict)
    joints: tuple[Joint, ...] = ()
    lines: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    static_load: Row | None = None
    harmonic_force: Complex[NDArray[np.complex128], "n r"] | None = None
    sensors: tuple[Sensor | LineSensor, ...] = ()
    dead_weights: Mapping[str, DeadWeight] = field(default_factory=dict)
    suspension: Matrix | None = None
    damped: Callable[[Sequence[Joint]], Matrix] | None = None
    histories: Histories | None = None
    details: Any = None


def stuck_at_rest(stiffness: Matrix, joints: Sequence[Joint]) -> Matrix:
    """Stiffness of the structure with the springs of all sliders and of the contacts that are closed at rest [N/m]."""
    return stuck_stiffness(stiffness, [joint for joint in joints if not joint.open_at_rest])
