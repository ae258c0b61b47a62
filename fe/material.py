"""Isotropic linear elastic material."""

from dataclasses import dataclass
from math import inf

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Material:
    """Isotropic linear elastic material.

    Parameters
    ----------
    young
        Young's modulus [Pa], positive.
    poisson
        Poisson's ratio [-], in (-1, 0.5).
    density
        Density [kg/m^3], positive.

    Raises
    ------
    InputError
        A value outside its range.
    """

    young: float
    poisson: float
    density: float

    def __post_init__(self) -> None:
        if not 0 < self.young < inf:
            raise InputError(f"young = {self.young:g} Pa must be positive and finite: steel has 210e9 Pa")
        if not -1 < self.poisson < 0.5:
            raise InputError(f"poisson = {self.poisson:g} must lie between -1 and 0.5: steel has 0.3")
        if not 0 < self.density < inf:
            raise InputError(f"density = {self.density:g} kg/m^3 must be positive and finite: steel has 7800 kg/m^3")

    @property
    def lame(self) -> float:
        """First Lamé constant, E nu / ((1 + nu)(1 - 2 nu)) [Pa]."""
        return self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))

    @property
    def shear(self) -> float:
        """Shear modulus, E / (2 (1 + nu)) [Pa]."""
        return self.young / (2 * (1 + self.poisson))

    def elasticity(self) -> Float[NDArray[np.float64], "6 6"]:
        """Stress from engineering strain, order xx, yy, zz, xy, yz, zx, shape (6, 6) [Pa]."""
        matrix = np.zeros((6, 6))
        matrix[:3, :3] = self.lame
        matrix[range(3), range(3)] += 2 * self.shear
        matrix[range(3, 6), range(3, 6)] = self.shear
        return matrix


#: Steel of the included blades: handbook values, because no material is published for the rig.
STEEL = Material(young=210e9, poisson=0.3, density=7800.0)
