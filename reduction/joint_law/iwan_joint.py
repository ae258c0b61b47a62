r"""Segalman's four-parameter Iwan joint: parallel sliders whose dissipation is a power of the amplitude.

Springs and sliders in parallel slip at displacements :math:`\phi` with the density

.. math:: \rho(\phi) = R\, \phi^\chi + S\, \delta(\phi - \phi_\mathrm{max}), \qquad 0 < \phi \le \phi_\mathrm{max} ,

with :math:`\beta = S (\chi + 1) / (R\, \phi_\mathrm{max}^{\chi + 1})`, the ratio of the stiffness of the last slider to
that of the others.

In micro-slip the work of a cycle grows with the amplitude to the power :math:`\chi + 3`. The density is represented by
`CELLS` sliders on a geometric grid, each at the centroid of its cell, so that stiffness and limit are exact, and by a
last slider at :math:`\phi_\mathrm{max}`.

References
----------
Segalman, A four-parameter Iwan model for lap-type joints, J. Appl. Mech. 72 (2005), 752-760.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reduction.array_type import Row
from reduction.joint_law.parallel_sliders import compute_vibration_energy
from reduction.joint_law.registry import LAWS, DirectedJoint, LawParameter, Samples

#: Number of cells of the grid, and first edge above zero relative to the displacement of macro-slip [-].
CELLS, FIRST = 32, 1e-3


@LAWS.register
@dataclass(frozen=True, kw_only=True, eq=False)
class IwanJoint(DirectedJoint):
    """Micro-slip of a bolted joint along one row.

    Parameters
    ----------
    name
        Name in messages and results.
    direction
        Row of u, shape (r,) [-].
    tangential_stiffness
        Stiffness K_T while all sliders stick [N/m].
    limit_force
        Force F_S at which all sliders slip [N].
    exponent
        Exponent chi, above -1: the work of a cycle grows with the power chi + 3 of the amplitude [-].
    ratio
        Ratio beta of the stiffness of the last spring to that of all others [-].

    Raises
    ------
    JointError
        A stiffness or a limit that is not positive, an exponent below -0.99, a negative ratio, or a number that is not
        finite.
    """

    kind = "iwan4"
    parameters = (
        LawParameter(name="tangential_stiffness", unit="N/m", meaning="K_T", typical=1e6, positive=True),
        LawParameter(name="limit_force", unit="N", meaning="F_S", typical=10.0, positive=True),
        LawParameter(name="exponent", unit="-", meaning="chi of the density", typical=-0.4, lower=-0.99, is_form=True),
        LawParameter(name="ratio", unit="-", meaning="beta, of the last slider", typical=0.5, lower=0.0, is_form=True),
    )
    typical_displacement = 2e-5
    n_slider = CELLS + 1

    tangential_stiffness: float
    limit_force: float
    exponent: float
    ratio: float

    @property
    def stuck_stiffness(self) -> tuple[float, ...]:
        """Stiffness K_T [N/m]."""
        return (self.tangential_stiffness,)

    def spring_energy(
        self, parameters: Mapping[str, float], displacement: Samples, force: Samples, slider: Samples
    ) -> Row:
        """Energy of all springs, each about its mean elongation."""
        stiffness, _ = make_cells(*(parameters[item.name] for item in self.parameters))
        return compute_vibration_energy(stiffness, displacement[0], slider)


def make_cells(stiffness: float, limit: float, exponent: float, ratio: float) -> tuple[Row, Row]:
    """Stiffness [N/m] and displacement at slip [m] of each slider, each of shape (CELLS + 1,)."""
    edges = np.array([0.0, *np.geomspace(FIRST, 1.0, CELLS)])
    share, moment = (np.diff(edges ** (exponent + power)) for power in (1, 2))
    mean = (exponent + 1) / (exponent + 2)
    largest = limit * (1 + ratio) / (stiffness * (ratio + mean))
    springs = np.array([*share, ratio]) * stiffness / (1 + ratio)
    return springs, largest * np.array([*(mean * moment / share), 1.0])
