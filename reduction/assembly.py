"""Several reduced bodies as one model; each keeps its boundary and shapes, and only contacts will join them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
import scipy.linalg
from jaxtyping import Complex, Float, Int, Num
from numpy.typing import NDArray

from fe.system import LinearSystem
from reduction.array_input import make_read_only
from reduction.array_type import Array, Matrix, Real, Whole
from reduction.craig_bampton import craig_bampton
from reduction.errors import RomError
from reduction.partition import Rows
from reduction.rom import Field, ReducedModel

Scalar = TypeVar("Scalar", np.float64, np.complex128)


@dataclass(frozen=True, kw_only=True, eq=False)
class ReducedAssembly:
    """Reduced bodies as one model; its coordinates are those of the bodies, one body after the other.

    Raises
    ------
    RomError
        No body.
    """

    bodies: Mapping[str, ReducedModel]
    """Reduced models by name, in order."""

    def __post_init__(self) -> None:
        if not self.bodies:
            raise RomError("an assembly without bodies is empty: give at least one reduced model")
        object.__setattr__(self, "bodies", MappingProxyType(dict(self.bodies)))

    @cached_property
    def mass(self) -> Matrix:
        """Mass, block diagonal, shape (r, r) [kg]."""
        return self._together("mass")

    @cached_property
    def damping(self) -> Matrix:
        """Damping, block diagonal, shape (r, r) [N s/m]."""
        return self._together("damping")

    @cached_property
    def stiffness(self) -> Matrix:
        """Stiffness, block diagonal, shape (r, r), singular if a body is held by contact only [N/m]."""
        return self._together("stiffness")

    @property
    def n_dof(self) -> int:
        """Number r of coordinates of all bodies [-]."""
        return sum(rom.n_dof for rom in self.bodies.values())

    def columns(self, body: str) -> slice:
        """Slice of the coordinates of a body.

        Raises
        ------
        RomError
            An unknown body; the message lists the existing ones.
        """
        start = 0
        for name, rom in self.bodies.items():
            if name == body:
                return slice(start, start + rom.n_dof)
            start += rom.n_dof
        raise RomError(f'the assembly has no body "{body}": it has {", ".join(self.bodies)}')

    def rows(self, body: str, name: str, direction: int | None = None) -> Int[Whole, " k"]:
        """Rows of a boundary set of a body in the assembly, see `ReducedModel.rows`.

        Raises
        ------
        RomError
            An unknown body, set or direction.
        """
        start: int = self.columns(body).start
        return np.asarray(start + self.bodies[body].rows(name, direction))

    def load(self, body: str, nodal: Float[Real, "node 3"]) -> Float[Real, " r"]:
        """Forces on the reduced coordinates from forces on the nodes of a body's mesh, shape (r,).

        Parameters
        ----------
        body
            Name of the body.
        nodal
            Nodal forces, shape (n_node, 3) [N].

        Raises
        ------
        RomError
            An unknown body, or forces of a shape that does not match its mesh.
        """
        columns = self.columns(body)
        rom = self.bodies[body]
        if np.shape(nodal) != (rom.n_node, 3):
            raise RomError(f"nodal forces of shape {np.shape(nodal)} are not those of {body}: give ({rom.n_node}, 3)")
        result = np.zeros(self.n_dof)
        result[columns] = rom.recovery.T @ np.asarray(nodal, dtype=np.float64).reshape(-1)[rom.free]
        return result

    def displacement(self, reduced: Float[Real, "r ..."] | Complex[Array, "r ..."]) -> dict[str, Field]:
        """Displacements of the meshes of all bodies from reduced coordinates, each of shape (n_node, 3, ...) [m].

        Raises
        ------
        RomError
            The length of the first axis is not r.
        """
        if not np.shape(reduced) or len(reduced) != self.n_dof:
            raise RomError(
                f"an array of shape {np.shape(reduced)} cannot be recovered: its first axis must be the {self.n_dof} "
                "coordinates"
            )
        return {body: rom.displacement(reduced[self.columns(body)]) for body, rom in self.bodies.items()}

    def on_whole_mesh(self, reduced: Num[NDArray[Scalar], "r m"]) -> Num[NDArray[Scalar], "m node 3"]:
        """Displacements of the joined mesh of all bodies from columns of reduced coordinates.

        Returns
        -------
        Displacements, nodes in the order of the bodies, shape (m, n_node, 3) [m].

        Raises
        ------
        RomError
            The length of the first axis is not r.
        """
        fields: Any = list(self.displacement(reduced).values())
        return np.moveaxis(np.concatenate(fields), 2, 0)

    def _together(self, name: str) -> Matrix:
        return make_read_only(scipy.linalg.block_diag(*(getattr(rom, name) for rom in self.bodies.values())))


def reduce_bodies(
    systems: Mapping[str, LinearSystem],
    boundary: Mapping[str, Mapping[str, Rows]],
    n_mode: int | Mapping[str, int] = 150,
) -> ReducedAssembly:
    """Reduce all bodies by Craig-Bampton, with a total number of modes or one for each body.

    Parameters
    ----------
    systems
        Full models by body; a body that is held by contact only has no supports.
    boundary
        Retained rows of the system of each body, by set name, as for `craig_bampton`.
    n_mode
        Total number of fixed-interface modes, chosen over all bodies by frequency, the lowest first; or a number for
        each body [-].

    Raises
    ------
    RomError
        As in `craig_bampton`, with the name of the body; or numbers of modes for an unknown body or not for all bodies.
    """
    if isinstance(n_mode, Mapping):
        if set(n_mode) != set(systems):
            raise RomError(
                f"numbers of modes are given for {', '.join(n_mode) or 'no body'}, but the bodies are "
                f"{', '.join(systems)}: give one number for each"
            )
        return ReducedAssembly(
            bodies={body: _reduce_body(body, system, boundary[body], n_mode[body]) for body, system in systems.items()}
        )
    # No body can have more modes than the total.
    bodies = {body: _reduce_body(body, system, boundary[body], n_mode) for body, system in systems.items()}
    return ReducedAssembly(bodies=select_lowest_modes(bodies, n_mode))


def select_lowest_modes(bodies: Mapping[str, ReducedModel], n_mode: int) -> dict[str, ReducedModel]:
    """Bodies with only those fixed-interface modes that are the lowest of all bodies.

    Parameters
    ----------
    bodies
        Reduced models by name, each with enough modes.
    n_mode
        Total number of modes of all bodies [-].
    """
    frequency = np.concatenate([rom.fixed_interface_frequency for rom in bodies.values()])
    owner = np.repeat(np.arange(len(bodies)), [len(rom.fixed_interface_frequency) for rom in bodies.values()])
    retained = np.bincount(owner[np.argsort(frequency, kind="stable")[:n_mode]], minlength=len(bodies))
    return {name: truncated(rom, int(n)) for (name, rom), n in zip(bodies.items(), retained, strict=True)}


def truncated(rom: ReducedModel, n_mode: int) -> ReducedModel:
    """Reduced model with only its lowest fixed-interface modes.

    Raises
    ------
    RomError
        More modes than the model has.
    """
    if not 0 <= n_mode <= len(rom.fixed_interface_frequency):
        raise RomError(
            f"{n_mode} modes were requested from a reduced model with {len(rom.fixed_interface_frequency)}: ask "
            "for fewer"
        )
    n = rom.n_boundary + n_mode
    return replace(
        rom,
        mass=rom.mass[:n, :n],
        damping=rom.damping[:n, :n],
        stiffness=rom.stiffness[:n, :n],
        fixed_interface_frequency=rom.fixed_interface_frequency[:n_mode],
        recovery=rom.recovery[:, :n],
    )


def _reduce_body(body: str, system: LinearSystem, boundary: Mapping[str, Rows], n_mode: int) -> ReducedModel:
    try:
        return craig_bampton(system, boundary, n_mode, {"body": body})
    except RomError as error:
        raise RomError(f"{body}: {error}") from error
