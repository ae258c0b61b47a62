"""Several reduced bodies as one model: each keeps its own boundary and shapes, and contacts alone will join them."""

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
    """Reduced bodies side by side; coordinates are those of the bodies, one after the other.

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
        """Block diagonal, shape (r, r) [kg]."""
        return self._together("mass")

    @cached_property
    def damping(self) -> Matrix:
        """Block diagonal, shape (r, r) [N s/m]."""
        return self._together("damping")

    @cached_property
    def stiffness(self) -> Matrix:
        """Block diagonal, shape (r, r), singular where a body is held by contact alone [N/m]."""
        return self._together("stiffness")

    @property
    def n_dof(self) -> int:
        """Coordinates of all bodies r [-]."""
        return sum(rom.n_dof for rom in self.bodies.values())

    def columns(self, body: str) -> slice:
        """Where the coordinates of a body are.

        Raises
        ------
        RomError
            No such body; the message lists those that exist.
        """
        start = 0
        for name, rom in self.bodies.items():
            if name == body:
                return slice(start, start + rom.n_dof)
            start += rom.n_dof
        raise RomError(f'the assembly has no body "{body}": it has {", ".join(self.bodies)}')

    def rows(self, body: str, name: str, direction: int | None = None) -> Int[Whole, " k"]:
        """Rows of a boundary set of a body, as `ReducedModel.rows` gives them.

        Raises
        ------
        RomError
            No such body, set or direction.
        """
        start: int = self.columns(body).start
        return np.asarray(start + self.bodies[body].rows(name, direction))

    def load(self, body: str, nodal: Float[Real, "node 3"]) -> Float[Real, " r"]:
        """Forces on the nodes of a body's mesh, as the reduced coordinates take them, shape (r,).

        Parameters
        ----------
        body
            Name of the body.
        nodal
            Forces, shape (n_node, 3) [N].

        Raises
        ------
        RomError
            No such body, or forces that are not those of its mesh.
        """
        columns = self.columns(body)
        rom = self.bodies[body]
        if np.shape(nodal) != (rom.n_node, 3):
            raise RomError(f"nodal forces of shape {np.shape(nodal)} are not those of {body}: give ({rom.n_node}, 3)")
        result = np.zeros(self.n_dof)
        result[columns] = rom.recovery.T @ np.asarray(nodal, dtype=np.float64).reshape(-1)[rom.free]
        return result

    def displacement(self, reduced: Float[Real, "r ..."] | Complex[Array, "r ..."]) -> dict[str, Field]:
        """Reduced coordinates as fields on the meshes of all bodies, each of shape (n_node, 3, ...) [m].

        Raises
        ------
        RomError
            Another first axis than the assembly's r coordinates.
        """
        if not np.shape(reduced) or len(reduced) != self.n_dof:
            raise RomError(
                f"an array of shape {np.shape(reduced)} cannot be recovered: its first axis must be the {self.n_dof} "
                "coordinates"
            )
        return {body: rom.displacement(reduced[self.columns(body)]) for body, rom in self.bodies.items()}

    def on_whole_mesh(self, reduced: Num[NDArray[Scalar], "r m"]) -> Num[NDArray[Scalar], "m node 3"]:
        """Columns of reduced coordinates as fields on the nodes of all bodies in their order, as in one mesh of them.

        Returns
        -------
        Array of shape (m, n_node, 3) [m].

        Raises
        ------
        RomError
            Another first axis than the assembly's r coordinates.
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
    """Craig-Bampton models of all bodies, with so many modal coordinates together.

    Parameters
    ----------
    systems
        Full models by body; a body that contact alone holds has no supports.
    boundary
        Rows of each body's system that are kept, by set name, as for `craig_bampton`.
    n_mode
        Fixed-interface modes of all bodies together [-], chosen across the bodies by frequency, the lowest first; or
        for each body.

    Raises
    ------
    RomError
        As `craig_bampton` raises it, with the name of the body; a number of modes for a body that is none, or for not
        all of them.
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
    # No body can have more than all of them.
    bodies = {body: _reduce_body(body, system, boundary[body], n_mode) for body, system in systems.items()}
    return ReducedAssembly(bodies=select_lowest_modes(bodies, n_mode))


def select_lowest_modes(bodies: Mapping[str, ReducedModel], n_mode: int) -> dict[str, ReducedModel]:
    """The same bodies with those fixed-interface modes alone that are the lowest of all.

    Parameters
    ----------
    bodies
        Reduced models by name, each with as many modes as it can be left with.
    n_mode
        Number of modes of all bodies together [-].
    """
    frequency = np.concatenate([rom.fixed_interface_frequency for rom in bodies.values()])
    owner = np.repeat(np.arange(len(bodies)), [len(rom.fixed_interface_frequency) for rom in bodies.values()])
    retained = np.bincount(owner[np.argsort(frequency, kind="stable")[:n_mode]], minlength=len(bodies))
    return {name: truncated(rom, int(n)) for (name, rom), n in zip(bodies.items(), retained, strict=True)}


def truncated(rom: ReducedModel, n_mode: int) -> ReducedModel:
    """The reduced model with its lowest fixed-interface modes alone.

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
