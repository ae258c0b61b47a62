"""What is built on a skeleton: places, contact lines, other joints, dashpots, damping, the drive."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from benchmarks.strangers.skeleton import Motion, Skeleton, Spot

Matrix = NDArray[np.float64]


class Mesh(Protocol):
    """What a skeleton is built from."""

    def build(self, refine: int) -> Skeleton:
        """With `refine` times as many elements along each edge."""
        ...


@dataclass(frozen=True, kw_only=True)
class Contact:
    """A friction contact: motions along normal and tangent, and its numbers in SI."""

    normal: Motion
    tangent: Motion
    normal_stiffness: float
    tangential_stiffness: float
    friction_coefficient: float
    preload: float
    gap: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Jenkins:
    """Spring and slider of constant limit, as a contact under constant normal load."""

    motion: Motion
    stiffness: float
    limit: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Blueprint:
    """A structure as its engineer draws it.

    Parameters
    ----------
    kind
        Of the mesh: chain, beam, frame, pair or plate.
    mesh
        What the skeleton is built from.
    finer
        By how much the specimen's mesh is finer than the model's; 1 where there is no mesh.
    ratio
        Damping ratio of all modes, or of two of them (`rayleigh`).
    rayleigh
        Whether damping is Rayleigh's, through the first mode and that of `highest` [rad/s].
    places
        Spots by name, where effects and sensors may be.
    drive
        Place of the force.
    lines
        Contacts by line; Jenkins elements and cubic springs [N/m^3] by name.
    dashpots
        Discrete dampers [N s/m] by place.
    free, stuck
        Angular frequency of the resonance that is tested, without contacts and with all that are closed stuck [rad/s].
    force
        Highest amplitude of the force that its contacts are made for [N].
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
        """Contacts and Jenkins elements."""
        return sum(map(len, self.lines.values())) + len(self.jenkins)

    def damping(self, skeleton: Skeleton) -> Matrix:
        """C, shape (r, r) [N s/m]."""
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
