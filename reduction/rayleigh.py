"""Rayleigh damping of a reduced model."""

from dataclasses import replace

from fe.damping import RayleighDamping
from reduction.rom import ReducedModel


def rayleigh_damped(rom: ReducedModel, damping: RayleighDamping) -> ReducedModel:
    """The reduced model with alpha M + beta K for its damping: what the full model's would be reduced to."""
    return replace(rom, damping=damping.mass_factor * rom.mass + damping.stiffness_factor * rom.stiffness)
