"""Reduced model: small dense matrices, named boundary sets, and recovery of the motion of the full mesh."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex, Float, Int

from fe.damping import RayleighDamping
from fe.dense_modes import compute_dense_modes
from fe.notebook import Tabular
from reduction.array_input import freeze_arrays, make_read_only
from reduction.array_type import Array, Real, Whole
from reduction.errors import RomError

if TYPE_CHECKING:
    import pandas

    from fe.modal import ModeSet

Reduced = Float[Real, "r ..."] | Complex[Array, "r ..."]
Field = Float[Real, "node 3 ..."] | Complex[Array, "node 3 ..."]

#: Names of the arrays of a reduced model in the order of its files: real numbers, then integers.
REAL = ("mass", "damping", "stiffness", "fixed_interface_frequency", "recovery")
WHOLE = ("boundary_node", "boundary_direction", "free")


@dataclass(frozen=True, kw_only=True, eq=False)
class ReducedModel(Tabular):
    """Craig-Bampton model: boundary degrees of freedom first, then fixed-interface modal coordinates.

    Arrays are copied and read-only; `recovery`, which can be gigabytes, is not copied, but is read-only as well.

    Parameters
    ----------
    mass, damping, stiffness
        Symmetric matrices, shape (r, r) [kg, N s/m, N/m; modal rows in the units of mass-normalised modes].
    boundary_node, boundary_direction
        Mesh node and direction (0, 1, 2) of each boundary degree of freedom, shape (b,) [-].
    boundary_sets
        Rows of the reduced system by boundary name, each of shape (k,) [-].
    fixed_interface_frequency
        Frequencies of the retained fixed-interface modes, ascending, shape (m,) [Hz]; r = b + m.
    recovery
        Matrix that gives the free displacements from the reduced coordinates, shape (n, r) [- and m].
    free
        Mesh degree of freedom (3 node + direction) of each row of `recovery`, shape (n,) [-].
    n_node
        Number of nodes of the mesh [-].
    provenance
        Origin of the model: case, versions, date and other texts.
    """

    mass: Float[Real, "r r"]
    damping: Float[Real, "r r"]
    stiffness: Float[Real, "r r"]
    boundary_node: Int[Whole, " b"]
    boundary_direction: Int[Whole, " b"]
    boundary_sets: Mapping[str, Int[Whole, " _"]]
    fixed_interface_frequency: Float[Real, " m"]
    recovery: Float[Real, "n r"]
    free: Int[Whole, " n"]
    n_node: int
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze_arrays(self, *(name for name in REAL if name != "recovery"))
        freeze_arrays(self, *WHOLE, dtype=np.int64)
        object.__setattr__(self, "recovery", make_read_only(np.asarray(self.recovery, dtype=np.float64).view()))
        sets = {name: make_read_only(np.array(rows, dtype=np.int64)) for name, rows in self.boundary_sets.items()}
        object.__setattr__(self, "boundary_sets", MappingProxyType(sets))
        object.__setattr__(self, "provenance", MappingProxyType(dict(self.provenance)))

    @property
    def n_dof(self) -> int:
        """Number of reduced coordinates r [-]."""
        return len(self.mass)

    @property
    def n_boundary(self) -> int:
        """Number of boundary degrees of freedom b; the other r - b coordinates are modal [-]."""
        return len(self.boundary_node)

    def to_pandas(self) -> "pandas.DataFrame":
        """Table with one row per boundary set, and one for the fixed-interface modes."""
        import pandas

        frequency = self.fixed_interface_frequency
        ends = [float(frequency[0]), float(frequency[-1])] if len(frequency) else [np.nan, np.nan]
        rows = {name: [len(rows), np.nan, np.nan] for name, rows in self.boundary_sets.items()}
        rows["fixed-interface modes"] = [len(frequency), *ends]
        columns = ["coordinates [-]", "lowest frequency [Hz]", "highest frequency [Hz]"]
        return pandas.DataFrame.from_dict(rows, orient="index", columns=columns)

    def rows(self, name: str, direction: int | None = None) -> Int[Whole, " k"]:
        """Rows of a boundary set in its given order, or only those of one direction (0, 1, 2 for x, y, z).

        Raises
        ------
        RomError
            An unknown set, or a direction that the set lacks; the message lists the available ones.
        """
        if name not in self.boundary_sets:
            known = ", ".join(sorted(self.boundary_sets)) or "none"
            raise RomError(f'the reduced model has no boundary set "{name}": it has {known}')
        rows = self.boundary_sets[name]
        if direction is None:
            return rows
        directions = self.boundary_direction[rows]
        if direction not in directions:
            available = ", ".join(str(d) for d in np.unique(directions))
            raise RomError(
                f'boundary set "{name}" has no degree of freedom in direction {direction}: it has {available}'
            )
        return np.asarray(rows[directions == direction])

    def modes(self, n_mode: int | None = None) -> "ModeSet":
        """Compute the lowest modes (all by default); `displacement` converts their reduced coordinates to the mesh.

        Raises
        ------
        RomError
            Fewer than one mode, or more modes than coordinates.
        """
        n_mode = self.n_dof if n_mode is None else n_mode
        if not 1 <= n_mode <= self.n_dof:
            raise RomError(
                f"{n_mode} modes were requested from a reduced model of {self.n_dof}: give 1 to {self.n_dof}"
            )
        from fe.modal import ModeSet  # imports meshes and elements, which most uses do not need

        result = compute_dense_modes(self.mass, self.stiffness)
        angular_frequency = np.sqrt(result.lambda_[:n_mode].clip(min=0))
        shapes = result.mode_shapes[:, :n_mode]
        modal_damping = np.einsum("rm,rs,sm->m", shapes, self.damping, shapes, optimize=True)
        damping_ratio = np.divide(
            modal_damping, 2 * angular_frequency, out=np.zeros(n_mode), where=angular_frequency > 0
        )
        return ModeSet(angular_frequency=angular_frequency, damping_ratio=damping_ratio, mode_shapes=shapes)

    def displacement(self, reduced: Reduced) -> Field:
        """Displacement of all nodes of the mesh from reduced coordinates, zero where fixed.

        Parameters
        ----------
        reduced
            Reduced coordinates, real or complex, shape (r,) or (r, ...).

        Returns
        -------
        Displacement, shape (n_node, 3) or (n_node, 3, ...) [m].

        Raises
        ------
        RomError
            The length of the first axis is not r.
        """
        shape = np.shape(reduced)
        if not shape or shape[0] != self.n_dof:
            raise RomError(
                f"an array of shape {shape} cannot be recovered: its first axis must be the {self.n_dof} coordinates"
            )
        columns = np.reshape(reduced, (self.n_dof, -1))
        full = np.zeros((3 * self.n_node, columns.shape[1]), dtype=np.result_type(columns, np.float64))
        if np.iscomplexobj(columns):
            # Two real products, because a complex product would first copy the whole recovery as complex.
            full[self.free] = self.recovery @ columns.real + 1j * (self.recovery @ columns.imag)
        else:
            full[self.free] = self.recovery @ columns
        return full.reshape(self.n_node, 3, *shape[1:])


def with_rayleigh_damping(rom: ReducedModel, damping: RayleighDamping) -> ReducedModel:
    """Reduced model with the damping alpha M + beta K, equal to the reduced Rayleigh damping of the full model."""
    return replace(rom, damping=damping.mass_factor * rom.mass + damping.stiffness_factor * rom.stiffness)
