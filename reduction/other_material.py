"""Reduced body in another material of the same Poisson's ratio; its shapes are the same, so it is only scaled."""

from dataclasses import replace
from math import sqrt

import numpy as np

from reduction.rom import ReducedModel


def in_other_material(rom: ReducedModel, density_ratio: float, modulus_ratio: float) -> ReducedModel:
    """Reduced model of a body with another density and Young's modulus; modes remain mass-normalised.

    Parameters
    ----------
    rom
        Reduced model whose mass and stiffness come only from the material.
    density_ratio, modulus_ratio
        New values over those of the model, positive [-].
    """
    if density_ratio == modulus_ratio == 1.0:
        return rom
    # Mass-normalised shapes are divided by the root of the density ratio.
    size = np.ones(rom.n_dof)
    size[rom.n_boundary :] = 1 / sqrt(density_ratio)
    both = np.outer(size, size)
    return replace(
        rom,
        mass=density_ratio * both * rom.mass,
        damping=both * rom.damping,
        stiffness=modulus_ratio * both * rom.stiffness,
        fixed_interface_frequency=sqrt(modulus_ratio / density_ratio) * rom.fixed_interface_frequency,
        recovery=rom.recovery * size,
    )
