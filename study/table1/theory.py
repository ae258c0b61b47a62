r"""Error of the fully integrated 8-node brick in a bending frequency, in closed form without fitted values.

In bending, the axial strain of a linear brick is right, but three other strains are wrong, because the deflection
(along y, through the thickness) has no quadratic terms:

- along the span it lacks z^2, which leaves a parasitic shear kappa z within each element,
- across the chord it lacks x^2, which leaves a parasitic shear nu kappa x,
- through the thickness it lacks y^2, so the lateral strain -nu kappa y is constant within each element.

Their energies add to that of the beam, and with the first mode's curvature kappa(z) Rayleigh's quotient gives

.. math::
    \frac{f^2}{f_0^2} = 1 + \frac{A}{12 I}\,\frac{\overline{h_z^2} + \nu^2 h_x^2}{2 (1 + \nu)} + \frac{c}{n^2},
    \qquad c = \nu^2 \frac{(\lambda + 2 \mu)}{E}

with A / (12 I) = 1 / t^2 for a rectangle and the span's element lengths averaged over the bending energy. f_0 is the
frequency of the quadratic model, which has none of these errors but the same clamp. The error of the linear model at
the clamp and the pads are neglected. c is the value for many layers: the extra compliance of a single layer across the
chord is neglected.
"""

from itertools import pairwise
from math import cos, cosh, sin, sinh

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.integrate import quad

from fe.material import Material
from fe.mesh import Mesh
from geometry.blade import Blade
from geometry.plain_blade import PlainBlade

#: beta L and sigma of the first mode of a clamped-free beam (Blevins, Formulas for Natural Frequency, table 8-1).
FIRST_MODE = 1.87510407
SIGMA = (cosh(FIRST_MODE) + cos(FIRST_MODE)) / (sinh(FIRST_MODE) + sin(FIRST_MODE))
#: Largest distance of nodes at the same station [m].
SAME_STATION = 1e-9


def compute_locking_factor(blade: Blade | PlainBlade, material: Material, mesh: Mesh, through_thickness: int) -> float:
    """Ratio f / f_0 of the first bending frequency with the parasitic strains of 8-node bricks to the exact one [-].

    Parameters
    ----------
    blade, material
        Blade without its pads, and its material.
    mesh
        Mesh of the blade, from which the element lengths are read.
    through_thickness
        Number of elements through the thickness [-].
    """
    nu = material.poisson
    area, inertia = section(blade)
    slenderness = area / (12 * inertia)
    span = find_span_stations(blade, mesh)
    chord = find_chord_stations(blade, mesh)
    energy = compute_bending_energy(span / blade.length)
    along = float(energy @ np.diff(span) ** 2)
    width = np.diff(chord)
    across = float((width**3).sum() / width.sum())
    shear = slenderness * (along + nu**2 * across) / (2 * (1 + nu))
    lateral = nu**2 * (material.lame + 2 * material.shear) / material.young / through_thickness**2
    return float(np.sqrt(1 + shear + lateral))


def section(blade: Blade | PlainBlade) -> tuple[float, float]:
    """Area [m^2] and second moment about the chord [m^4] of the blade's section outside the pads."""
    t = blade.thickness
    if isinstance(blade, PlainBlade):
        return blade.chord * t, blade.chord * t**3 / 12
    e, bevels = blade.edge_thickness, blade.chord - blade.flat_width
    area = blade.flat_width * t + bevels * (t + e) / 2
    # The mean of a linearly varying thickness cubed is (t^2 + e^2)(t + e) / 4.
    inertia = (blade.flat_width * t**3 + bevels * (t**2 + e**2) * (t + e) / 4) / 12
    return area, inertia


def find_span_stations(blade: Blade | PlainBlade, mesh: Mesh) -> Float[NDArray[np.float64], " k"]:
    """Heights z of the element boundaries along the blade's edge, from root to tip [m]."""
    corners = mesh.points[mesh.corner_nodes()]
    edge = (np.abs(corners[:, 0] - blade.chord / 2) < SAME_STATION) & (corners[:, 2] > -SAME_STATION)
    return _find_distinct(corners[edge, 2])


def find_chord_stations(blade: Blade | PlainBlade, mesh: Mesh) -> Float[NDArray[np.float64], " k"]:
    """Chordwise positions x of the element boundaries at the tip [m]."""
    corners = mesh.points[mesh.corner_nodes()]
    return _find_distinct(corners[corners[:, 2] > blade.length - SAME_STATION, 0])


def compute_bending_energy(stations: Float[NDArray[np.float64], " k"]) -> Float[NDArray[np.float64], " k1"]:
    """Fraction of the first mode's bending energy between stations z / L, shape (k - 1,) [-]."""

    def curvature_squared(s: float) -> float:
        b = FIRST_MODE * s
        return (cosh(b) + cos(b) - SIGMA * (sinh(b) + sin(b))) ** 2

    parts = [quad(curvature_squared, a, b)[0] for a, b in pairwise(stations)]
    return np.asarray(parts) / sum(parts)


def _find_distinct(values: Float[NDArray[np.float64], " m"]) -> Float[NDArray[np.float64], " k"]:
    ordered = np.sort(values)
    return ordered[np.r_[True, np.diff(ordered) > SAME_STATION]]
