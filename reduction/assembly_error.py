"""Error of a reduced assembly against the full bodies: frequencies, shapes, and receptances at the contacts."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from fe.blas_threads import on_one_blas_thread
from fe.dense_modes import compute_dense_modes
from fe.modal import modes
from fe.sparse.solver import Definiteness, Factor, Factorisation, factorise
from fe.system import LinearSystem
from reduction.array_input import freeze_arrays
from reduction.array_type import Matrix, Real, Vector, Whole
from reduction.assembly import ReducedAssembly
from reduction.errors import RomError

#: Relative distance of frequencies below which modes are compared as a group: repeated modes, and modes of equal parts.
SAME_FREQUENCY = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class AssemblyError:
    """Comparison of a reduced assembly with its full bodies, without damping and with the same springs between them."""

    frequency: Float[Real, " m"]
    """Natural frequencies of the full model, shape (m,) [Hz]."""
    frequency_error: Float[Real, " m"]
    """Relative error (f_reduced - f_full) / f_full, shape (m,) [-]."""
    mac: Float[Real, " m"]
    """MAC of each recovered shape and the full shape of the same number, shape (m,) [-]. For full frequencies closer to
    each other than `SAME_FREQUENCY`, whose shapes may mix, it is the squared cosine to the space of these shapes."""
    receptance_frequency: Float[Real, " k"]
    """Frequencies at which receptances are compared, shape (k,) [Hz]."""
    receptance_error: Float[Real, " k"]
    """Error ||H_reduced - H_full|| / ||H_full|| at these frequencies, in the Frobenius norm over all coordinates with
    springs, shape (k,) [-]. It is meaningless at a resonance, where it only measures the distance to the pole."""

    def __post_init__(self) -> None:
        freeze_arrays(self, *vars(self))


@on_one_blas_thread
def assembly_error(
    systems: Mapping[str, LinearSystem],
    assembly: ReducedAssembly,
    springs: Matrix,
    n_mode: int,
    receptance_frequency: Float[Real, " k"],
) -> AssemblyError:
    """Compute the error of a reduced assembly by solving the joined bodies in full and reduced.

    The cost is one factorisation of the full stiffness, and one of K - omega^2 M for each frequency.

    Parameters
    ----------
    systems
        Full models from which the bodies were reduced.
    assembly
        Reduced models of the bodies.
    springs
        Stiffness of springs between bodies and to the ground, over the coordinates of the assembly, such as
        `JoinedBodies.springs` [N/m]. With them no motion is free.
    n_mode
        Number of frequencies and shapes to compare [-].
    receptance_frequency
        Frequencies between resonances, shape (k,) [Hz].

    Raises
    ------
    RomError
        A body that is missing or was not reduced from its system; or springs that are zero, of another shape, or on
        modal coordinates.
    SupportError
        The springs leave a motion free.
    """
    full = join_systems(systems, assembly, springs)
    if not 1 <= n_mode <= assembly.n_dof:
        raise RomError(f"{n_mode} modes cannot be compared: the assembly has {assembly.n_dof}")
    joined = np.flatnonzero(np.any(springs != 0, axis=1))
    if not len(joined):
        raise RomError("all springs are zero, so the bodies are not connected: give the springs of their contacts")
    result = modes(full, n_mode)
    stiffness = assembly.stiffness + springs
    reduced = compute_dense_modes(assembly.mass, stiffness)
    frequency = np.sqrt(reduced.lambda_[:n_mode]) / (2 * np.pi)
    shapes = np.concatenate(
        [rom.recovery @ reduced.shapes[assembly.columns(body), :n_mode] for body, rom in assembly.bodies.items()]
    )
    rows = _find_physical_rows(systems, assembly)[joined]
    errors = []
    factor: Factorisation | None = None
    for omega in 2 * np.pi * np.asarray(receptance_frequency):
        dynamic = sp.csr_array(full.stiffness - omega**2 * full.mass)
        if factor is None:
            factor = factorise(dynamic, Definiteness.INDEFINITE)
        else:
            factor.renew(dynamic)
        exact = _compute_receptance(factor, full.n_dof, rows)
        small = np.linalg.inv(stiffness - omega**2 * assembly.mass)[np.ix_(joined, joined)]
        errors.append(float(np.linalg.norm(small - exact) / np.linalg.norm(exact)))
    return AssemblyError(
        frequency=result.frequency,
        frequency_error=frequency / result.frequency - 1,
        mac=_mac(shapes, result.mode_shapes, result.frequency),
        receptance_frequency=receptance_frequency,
        receptance_error=np.array(errors),
    )


def _mac(shapes: Matrix, exact: Matrix, frequency: Vector) -> Vector:
    """Squared cosine of each shape to the space of the exact shapes with nearly its frequency."""
    result = []
    for shape, own in zip(shapes.T, frequency, strict=True):
        basis, _ = np.linalg.qr(exact[:, np.abs(frequency - own) <= SAME_FREQUENCY * own])
        result.append(float(np.sum((basis.T @ shape) ** 2) / (shape @ shape)))
    return np.array(result)


def join_systems(systems: Mapping[str, LinearSystem], assembly: ReducedAssembly, springs: Matrix) -> LinearSystem:
    """Linear system of the full bodies, in the order of the assembly, with springs between their boundary rows."""
    if springs.shape != (assembly.n_dof, assembly.n_dof):
        raise RomError(
            f"springs of shape {springs.shape} are not those of the assembly: give ({assembly.n_dof}, {assembly.n_dof})"
        )
    joined = np.flatnonzero(np.any(springs != 0, axis=1))
    rows = _find_physical_rows(systems, assembly)[joined]
    if (rows < 0).any():
        raise RomError(
            f"springs act on the modal coordinate {joined[rows < 0][0]}, which the full model does not have: put "
            "springs only between boundary coordinates"
        )
    own = [systems[body] for body in assembly.bodies]
    n_dof = sum(system.n_dof for system in own)
    to, of = np.repeat(rows, len(rows)), np.tile(rows, len(rows))
    between = sp.csr_array((springs[np.ix_(joined, joined)].ravel(), (to, of)), shape=(n_dof, n_dof))
    between.eliminate_zeros()
    node = np.cumsum([0, *(system.n_node for system in own)])
    mass = sp.csr_array(sp.block_diag([system.mass.tocsr() for system in own]))
    return LinearSystem(
        mass=mass,
        damping=sp.csr_array(mass.shape),
        stiffness=sp.csr_array(sp.block_diag([system.stiffness.tocsr() for system in own]) + between),
        free=np.concatenate([3 * start + system.free for start, system in zip(node, own, strict=False)]),
        n_node=int(node[-1]),
    )


def _find_physical_rows(systems: Mapping[str, LinearSystem], assembly: ReducedAssembly) -> Int[Whole, " r"]:
    """Row of the full model for each coordinate of the assembly; -1 for modal coordinates."""
    result, start = np.full(assembly.n_dof, -1), 0
    for body, rom in assembly.bodies.items():
        if body not in systems:
            raise RomError(f"there is no full model of {body}, but of {', '.join(systems)}: give one for each body")
        system = systems[body]
        if system.n_node != rom.n_node or not np.array_equal(system.free, rom.free):
            raise RomError(f"{body} was not reduced from the system that is given for it: give the one that was")
        first = assembly.columns(body).start
        own = np.searchsorted(rom.free, 3 * rom.boundary_node + rom.boundary_direction)
        result[first : first + rom.n_boundary] = start + own
        start += system.n_dof
    return result


def _compute_receptance(factor: Factor, n_dof: int, rows: Int[Whole, " b"]) -> Matrix:
    """Displacement of some rows under unit forces on them [m/N]."""
    force = np.zeros((n_dof, len(rows)))
    force[rows, np.arange(len(rows))] = 1.0
    return np.asarray(factor.solve(force)[rows])
