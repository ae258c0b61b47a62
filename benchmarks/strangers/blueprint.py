"""Blueprint of a structure: a skeleton with places, contact lines, other joints, dashpots, damping and drive."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from benchmarks.strangers.skeleton import Motion, Skeleton, Spot

Matrix = NDArray[np.float64]


class Mesh(Protocol):
    """Mesh from which a skeleton is built."""

    def build(self, refine: int) -> Skeleton:
        """Build a skeleton with `refine` times as many elements along each edge."""
        ...


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Friction contact: motions along normal and tangent, and parameters in SI units."""

    normal: Motion
    tangent: Motion
    normal_stiffness: float
    tangential_stiffness: float
    friction_coefficient: float
    preload: float
    gap: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Jenkins:
    """Spring and slider with constant limit, like a contact under constant normal load."""

    motion: Motion
    stiffness: float
    limit: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Blueprint:
    """Structure as drawn by an engineer.

    Parameters
    ----------
    kind
        Kind of the mesh: chain, beam, frame, pair or plate.
    mesh
        Mesh of the skeleton.
    finer
        Factor by which the specimen's mesh is finer than that of the model; 1 for a chain.
    ratio
        Damping ratio of all modes, or of two modes (`rayleigh`).
    rayleigh
        Whether damping is Rayleigh damping with `ratio` at the first mode and at `highest`.
    highest
        Angular frequency of the second mode of Rayleigh damping [rad/s].
    places
        Spots of possible effects and sensors by name.
    drive
        Place of the force.
    lines, jenkins, cubic
        Contacts by line; Jenkins elements by name; places and stiffnesses of cubic springs [N/m^3] by name.
    dashpots
        Discrete dampers [N s/m] by place.
    free, stuck
        Angular frequency of the tested resonance without contacts, and with all closed contacts stuck [rad/s].
    force
        Highest amplitude of the force, for which the contacts are designed [N].
    """

    kind: str
    mesh: Mesh
    finer: int
    ratio: float
    rayleigh: bool
    highest: float = 0.0
    places: Mapping[str, Spot] = field(default_factory=dict)
    drive: str = ""
    lines: Mapping[str, Sequence[Contact]] = field(default_factory=dict)
    jenkins: Mapping[str, Jenkins] = field(default_factory=dict)
    cubic: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    dashpots: Mapping[str, float] = field(default_factory=dict)
    free: float = 0.0
    stuck: float = 0.0
    force: float = 1.0

    @property
    def n_contact(self) -> int:
        """Number of contacts and Jenkins elements."""
        return sum(map(len, self.lines.values())) + len(self.jenkins)

    def damping(self, skeleton: Skeleton) -> Matrix:
        """Damping matrix C, shape (r, r) [N s/m]."""
        squared, shapes = scipy.linalg.eigh(skeleton.stiffness, skeleton.mass)
        natural = np.sqrt(squared)
        if self.rayleigh:
            first = natural[0]
            factor = 2 * self.ratio / (first + self.highest)
            damping = factor * (first * self.highest * skeleton.mass + skeleton.stiffness)
        else:
            weighted = skeleton.mass @ shapes
            damping = weighted * (2 * self.ratio * natural) @ weighted.T
        for place, dashpot in self.dashpots.items():
            row = skeleton.row(((self.places[place], 1.0),))
            damping = damping + dashpot * np.outer(row, row)
        return np.asarray(damping)
