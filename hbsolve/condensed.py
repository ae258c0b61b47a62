r"""The linear structure condensed to the joint directions: their receptance, and its derivative in Omega.

With D the reference stiffness of the joints and B their rows, the stuck structure is K_stuck = K + B^T D B and

.. math:: A_k = B\, \alpha_\mathrm{stuck}(k \Omega)\, B^T, \qquad
          \alpha_\mathrm{stuck}(\omega) = (K_\mathrm{stuck} - \omega^2 M + i (\omega C + H))^{-1}

One decomposition serves all frequencies: that of the stuck structure if its modes uncouple the damping, else that of
the structure without joints (where Rayleigh damping of K is uncoupled), to which the contact stiffness is added in the
few joint directions,

.. math:: A = (I + A^0 D)^{-1} A^0 .

Damping that neither set of modes uncouples takes one dense solve per harmonic.

References
----------
Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eq. 12.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np
from jaxtyping import Complex, Float

from hbsolve.dynamic_stiffness import DynamicStiffness, stack_unit_forces_and_force
from hbsolve.errors import ModelError
from hbsolve.fourier import Coefficients, harmonics
from hbsolve.free_body import is_free
from hbsolve.modal_coordinates import ModalCoordinates
from reduction.array_type import Array, Matrix, Real, Vector

T = TypeVar("T")

#: Stiffness of centring springs for a body held by joints alone, over that of the joints: if all of them slip, only
#: these springs determine its mean position.
CENTRING_STIFFNESS = 1e-9
#: Memory of the modal responses that are computed at once [byte]: they stay in the cache of the processor.
CHUNK_SIZE = 2**21


class Condensed(NamedTuple):
    """The linear structure at one Omega; d joint directions, harmonics 0 to H."""

    angular_frequency: float
    columns: Array
    """Columns of A_k, one in each row: displacements under a unit force along one direction, shape (H + 1, d, d) [m/N].
    """
    static: Array
    """Displacement of the directions under the static load, in harmonic 0, shape (H + 1, d) [m]."""
    dynamic: Array
    """Displacement of the directions under the harmonic force at level 1, shape (H + 1, d) [m]."""
    slopes: "CondensedSlopes | None" = None
    """Derivatives in Omega, if computed."""

    @property
    def receptance(self) -> Array:
        """A_k, a view of shape (H + 1, d, d) [m/N]."""
        return self.columns.swapaxes(1, 2)


class CondensedSlopes(NamedTuple):
    """Derivatives of a condensed structure in Omega."""

    columns: Array
    """Columns of dA_k/dOmega, one in each row, shape (H + 1, d, d)."""
    dynamic: Array
    """Derivative of the displacement under the harmonic force, shape (H + 1, d)."""


class Recovery(NamedTuple):
    """Responses of the r degrees of freedom of the stuck structure at one Omega, to loads and to unit joint forces."""

    static: Array
    """Displacement under the static load, in harmonic 0, shape (H + 1, r) [m]."""
    dynamic: Array
    """Displacement under the harmonic force at level 1, shape (H + 1, r) [m]."""
    contact: Array
    """Displacement under a unit force along each joint direction, shape (H + 1, r, d) [m/N]."""

    def at_rows(self, rows: Float[Real, "s r"]) -> tuple[Complex[Array, "harmonic s"], Complex[Array, "harmonic s d"]]:
        """Displacement of some rows: under the harmonic force, and under unit joint forces."""
        return self.dynamic @ rows.T, rows @ self.contact


@dataclass(frozen=True, kw_only=True, eq=False)
class CondensedStructure:
    """A structure to be condensed to its joint directions.

    Raises
    ------
    ModelError
        Matrices that describe no vibrating structure, or a structure without support even with all contacts stuck.
    """

    mass: Float[Real, "r r"]
    damping: Float[Real, "r r"]
    stiffness: Float[Real, "r r"]
    """Stiffness without the joints, shape (r, r); with centring springs for a body held by joints alone."""
    directions: Float[Real, "d r"]
    """B, shape (d, r)."""
    reference: Float[Real, " d"]
    """D, shape (d,) [N/m]."""
    static: Coefficients
    dynamic: Coefficients
    """Coefficients of the static load, and of the harmonic force at level 1, shape (H + 1, r) [N]."""
    basis: Float[Real, "r r"] | None = None
    """Mode shapes of a similar structure without the joints; none by default."""
    structural: Float[Real, "r r"] | None = None
    """H, the imaginary part of a complex stiffness, shape (r, r) [N/m]; none by default."""
    is_centred: bool = field(init=False)
    """Whether the structure is held by joints alone, and the stiffness has weak springs in their directions."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "is_centred", is_free(self.stiffness, self._joint_stiffness))
        if self.is_centred:
            object.__setattr__(self, "stiffness", self.stiffness + CENTRING_STIFFNESS * self._joint_stiffness)
        stuck = self.stuck
        if stuck.n_rigid:
            raise ModelError(
                f"with all contacts stuck the stiffness still leaves {stuck.n_rigid} rigid-body motions free: hold the "
                "body by a support, a spring or a contact in that direction"
            )

    @cached_property
    def stuck(self) -> DynamicStiffness:
        """The structure with all contacts stuck and closed."""
        stiffness = self.stiffness + self._joint_stiffness
        return DynamicStiffness(mass=self.mass, damping=self.damping, stiffness=stiffness, structural=self.structural)

    @cached_property
    def _joint_stiffness(self) -> Matrix:
        """Stiffness of all joints stuck and closed, B^T D B, shape (r, r) [N/m]."""
        return np.asarray(self.directions.T @ (self.reference[:, None] * self.directions))

    @property
    def is_dense(self) -> bool:
        """Whether no modes uncouple the damping, so that each frequency takes dense solves."""
        return self.stuck.damping_couples_modes and self._free is None

    @cached_property
    def _free(self) -> ModalCoordinates | None:
        """Coordinates of the structure without joints, if only these uncouple the damping."""
        if not self.stuck.damping_couples_modes:
            return None
        return DynamicStiffness(
            mass=self.mass,
            damping=self.damping,
            stiffness=self.stiffness,
            basis=self.basis,
            structural=self.structural,
        ).modal

    @cached_property
    def _rest(self) -> tuple[Array, Array]:
        """Static displacement under a unit force along each direction, and under the load, shapes (r, d) and (r,)."""
        moved = self.stuck.static_response(np.column_stack([self.directions.T, self.static[0]]).T).T
        return np.asarray(moved[:, :-1]), np.asarray(moved[:, -1])

    @cached_property
    def _at_rest(self) -> tuple[Array, Array]:
        """Both displacements along the directions, shapes (d, d) and (d,)."""
        contact, load = self._rest
        return np.asarray(self.directions @ contact), np.asarray(self.directions @ load)

    def with_static(self, static: Coefficients) -> "CondensedStructure":
        """The same structure under another static load, shape (H + 1, r) [N]."""
        other = copy(self)
        other.__dict__.pop("_at_rest", None)
        other.__dict__["_rest"] = self._rest[0], self.stuck.static_response(static[:1])[0]
        object.__setattr__(other, "static", static)
        return other

    def with_rows(self, rows: Float[Real, "s r"]) -> "CondensedStructure":
        """The same structure with further rows after its directions, on which no stiffness acts, shape (s, r)."""
        other = copy(self)
        for name in ("_rest", "_at_rest"):
            other.__dict__.pop(name, None)
        object.__setattr__(other, "directions", np.vstack([self.directions, rows]))
        object.__setattr__(other, "reference", np.concatenate([self.reference, np.zeros(len(rows))]))
        return other

    @property
    def static_motion(self) -> Coefficients:
        """Displacement of the stuck structure under the static load, in harmonic 0, shape (H + 1, r) [m]."""
        moved = np.zeros_like(self.static)
        moved[0] = self._rest[1]
        return moved

    def at(self, angular_frequency: float) -> Condensed:
        """Condense at one Omega [rad/s]."""
        return self.at_each([angular_frequency])[0]

    def at_each(self, angular_frequencies: Sequence[float]) -> list[Condensed]:
        """Condense at several Omega [rad/s], in groups: for a single one the calls take longer than the arithmetic."""
        size = 16 * (len(self.directions) + 1) * len(self.dynamic) * self.directions.shape[1]
        return [item for chunk in _split_chunks(angular_frequencies, size) for item in self._condense(chunk)]

    def _condense(self, angular_frequencies: Sequence[float]) -> list[Condensed]:
        """Condense at all Omega of a group."""
        free, count = self._free, len(angular_frequencies)
        omega, force = self._all_harmonics(angular_frequencies)
        A, x = (free or self.stuck).condense(omega, self.directions, force)
        if free is not None:
            moved = _with_stiffness(A, np.concatenate([A, x[..., None]], axis=2), self.reference)
            A, x = np.ascontiguousarray(moved[..., :-1]), moved[..., -1]
        parts = zip(angular_frequencies, np.split(A, count), np.split(x, count), strict=True)
        return [self._joined(*part) for part in parts]

    def at_with_recovery(self, angular_frequency: float) -> tuple[Condensed, "Recovery"]:
        """`at` and `recovery` of a structure that takes dense solves, from one dense solve."""
        omega = harmonics(angular_frequency, len(self.dynamic))
        moved = self.stuck.solve(omega[1:], stack_unit_forces_and_force(self.directions, self.dynamic[1:]))
        along = self.directions @ moved
        condensed = self._joined(angular_frequency, np.ascontiguousarray(along[..., :-1]), along[..., -1])
        return condensed, Recovery(self.static_motion, *_with_mean(moved[..., -1], moved[..., :-1], self._rest[0]))

    def at_with_slopes(self, angular_frequency: float) -> Condensed:
        """Condense at one Omega [rad/s], with derivatives in it."""
        omega, free, D = harmonics(angular_frequency, len(self.dynamic)), self._free, self.reference
        A, dA, x, dx = (free or self.stuck).condense_with_slopes(omega[1:], self.directions, self.dynamic[1:])
        if free is not None:
            d = len(D)
            moved = _with_stiffness(A, np.concatenate([A, x[..., None], dA, dx[..., None]], axis=2), D)
            A, x, dA, dx = np.ascontiguousarray(moved[..., :d]), moved[..., d], moved[..., d + 1 : -1], moved[..., -1]
            dx = dx - ((dA * D) @ x[..., None])[..., 0]
            dA = dA - (dA * D) @ A
        k = np.arange(len(omega))
        slope, dynamic = np.zeros((len(omega), *A.shape[1:]), dtype=A.dtype), np.zeros((len(omega), len(D)), A.dtype)
        slope[1:], dynamic[1:] = k[1:, None, None] * dA, k[1:, None] * dx
        slopes = CondensedSlopes(self._columns(slope), dynamic)
        return self._joined(angular_frequency, A, x)._replace(slopes=slopes)

    def _joined(self, angular_frequency: float, A: Array, x: Array) -> Condensed:
        """Combine the mean with harmonics 1 to H."""
        mean, x_static = self._at_rest
        dynamic = np.concatenate([np.zeros_like(x[:1]), x]) if len(x) else np.zeros((1, len(mean)), dtype=np.complex128)
        static = np.zeros_like(dynamic)
        static[0] = x_static
        return Condensed(angular_frequency, np.concatenate([mean[None], self._columns(A)]), static, dynamic)

    def _columns(self, A: Array) -> Array:
        """Columns of receptances; where modes uncouple the damping, A is symmetric and its columns are its rows."""
        return np.ascontiguousarray(A.swapaxes(1, 2)) if self.is_dense else A

    def recovery(self, condensed: Condensed) -> Recovery:
        """Recovery of the full responses of many states at one Omega; for one state `displacement` costs less."""
        return self.recoveries([condensed])[0]

    def recoveries(self, condensed: Sequence[Condensed]) -> list[Recovery]:
        """`recovery` at several Omega, in groups."""
        chunks = _split_chunks(condensed, 16 * (len(self.directions) + 1) * self.static.size)
        return [item for chunk in chunks for item in self._recover(chunk)]

    def _recover(self, condensed: Sequence[Condensed]) -> list[Recovery]:
        """`recoveries` at all Omega of a group."""
        omega, force = self._all_harmonics([item.angular_frequency for item in condensed])
        along = np.repeat(self.directions[:, None, :], len(omega), axis=1)
        moved = (self._free or self.stuck).response(omega, np.concatenate([along, force[None]]))
        rows = self._of_stuck_structure(condensed, moved[-1], np.moveaxis(moved[:-1], 0, 2))
        return [Recovery(self.static_motion, *_with_mean(*entry, self._rest[0])) for entry in rows]

    def recover_rows(
        self, condensed: Sequence[Condensed], rows: Float[Real, "s r"]
    ) -> list[tuple[Complex[Array, "harmonic s"], Complex[Array, "harmonic s d"]]]:
        """Displacement of some rows at several Omega, as `recovery` gives it for all degrees of freedom.

        Returns
        -------
        For each Omega, the displacement under the harmonic force at level 1 [m], and under a unit force along each
        joint direction [m/N].
        """
        if self.is_dense:
            return [self.recovery(item).at_rows(rows) for item in condensed]
        size = 16 * len(rows) * len(self.dynamic) * self.directions.shape[1]
        return [item for chunk in _split_chunks(condensed, size) for item in self._recover_rows(chunk, rows)]

    def _recover_rows(
        self, condensed: Sequence[Condensed], rows: Float[Real, "s r"]
    ) -> list[tuple[Complex[Array, "harmonic s"], Complex[Array, "harmonic s d"]]]:
        """`recover_rows` at all Omega of a group."""
        omega, force = self._all_harmonics([item.angular_frequency for item in condensed])
        modal = self._free or self.stuck.modal
        assert modal is not None
        contact, dynamic = modal.condense_to_rows(omega, rows, self.directions, force)
        mean = rows @ self._rest[0]
        return [_with_mean(*entry, mean) for entry in self._of_stuck_structure(condensed, dynamic, contact)]

    def _of_stuck_structure(
        self, condensed: Sequence[Condensed], dynamic: Complex[Array, "F n"], contact: Complex[Array, "F n d"]
    ) -> list[tuple[Complex[Array, "H n"], Complex[Array, "H n d"]]]:
        """Motion of n rows of the stuck structure, at each Omega, from that of the structure whose modes are used.

        Parameters
        ----------
        condensed
            The structure at all Omega.
        dynamic, contact
            Motion under the harmonic force [m], and under a unit force along each joint direction [m/N], at harmonics 1
            to H of all Omega.
        """
        if self._free is not None:
            # alpha_stuck f = alpha_free (f - B^T D B alpha_stuck f)
            resisted = contact * self.reference
            contact = contact - resisted @ np.concatenate([item.receptance[1:] for item in condensed])
            moved = np.concatenate([item.dynamic[1:] for item in condensed])
            dynamic = dynamic - (resisted @ moved[..., None])[..., 0]
        return list(zip(np.split(dynamic, len(condensed)), np.split(contact, len(condensed)), strict=True))

    def _all_harmonics(self, angular_frequencies: Sequence[float]) -> tuple[Vector, Array]:
        """Harmonics 1 to H of all Omega, shape (F H,) [rad/s], and the force in them, shape (F H, r) [N]."""
        omega = np.outer(angular_frequencies, np.arange(1, len(self.dynamic))).ravel()
        return omega, np.tile(self.dynamic[1:], (len(angular_frequencies), 1))

    def displacement(self, condensed: Condensed, force: Coefficients) -> Coefficients:
        """Full response of the stuck structure to the coefficients of a force, shape (H + 1, r) [m]."""
        return np.asarray(self.displacements(condensed, force[None])[0])

    def displacements(
        self, condensed: Condensed, forces: Complex[Array, "p harmonic r"]
    ) -> Complex[Array, "p harmonic r"]:
        """Full responses of the stuck structure to several forces, shape (p, H + 1, r) both [N, m]."""
        return self.displacements_at_each([condensed], forces)[0]

    def displacements_at_each(
        self, condensed: Sequence[Condensed], forces: Complex[Array, "p harmonic r"]
    ) -> list[Complex[Array, "p harmonic r"]]:
        """`displacements` at several Omega, in groups.

        Where the damping couples the modes of the stuck structure but not those of the structure without joints, the
        latter give the response: with A the condensed receptance, B alpha_stuck f = (I - A D) B alpha_free f.
        """
        mean, chunks = self._mean(forces), _split_chunks(condensed, 16 * forces.size)
        return [
            np.concatenate([mean, item], axis=1)
            for chunk in chunks
            for item in np.split(self._moved(chunk, np.tile(forces[:, 1:], (1, len(chunk), 1))), len(chunk), axis=1)
        ]

    def displacements_at_own_frequency(
        self, condensed: Sequence[Condensed], forces: Complex[Array, "n harmonic r"]
    ) -> Complex[Array, "n harmonic r"]:
        """Full response to one force at each of n Omega, shape (n, H + 1, r) both [N, m]."""
        moved, first = np.concatenate([self._mean(forces), np.empty_like(forces[:, 1:])], axis=1), 0
        for chunk in _split_chunks(condensed, 16 * forces[:1].size):
            own = slice(first, first := first + len(chunk))
            of_chunk = forces[own, 1:].reshape(-1, forces.shape[2])
            moved[own, 1:] = self._moved(chunk, of_chunk).reshape(len(chunk), -1, forces.shape[2])
        return moved

    def _mean(self, forces: Complex[Array, "p harmonic r"]) -> Complex[Array, "p 1 r"]:
        """Response to the mean of each force."""
        stuck, rest = self.stuck, forces[:, :1]
        return stuck.response(np.zeros(1), rest) if self._free is None else stuck.static_response(rest[:, 0])[:, None]

    def _moved(self, condensed: Sequence[Condensed], forces: Complex[Array, "... F r"]) -> Complex[Array, "... F r"]:
        """Response to forces in harmonics 1 to H of all Omega, which follow one another along the axis F."""
        free = self._free
        omega, _ = self._all_harmonics([item.angular_frequency for item in condensed])
        if free is None:
            return self.stuck.response(omega, forces)
        B, D = self.directions, self.reference
        receptance = np.concatenate([item.receptance[1:] for item in condensed])

        def reaction(moved: Array) -> Array:
            """Reaction of the stuck contacts to a motion of the free structure."""
            stuck = moved - (receptance @ (D * moved)[..., None])[..., 0]
            return np.asarray(D * stuck)

        return free.response_with_reaction(omega, forces, B, reaction)


def _with_mean(dynamic: Array, contact: Array, mean: Array) -> tuple[Array, Array]:
    """Add harmonic 0 to the motion under the harmonic force, where it is zero, and under joint forces."""
    return np.concatenate([np.zeros((1, len(mean))), dynamic]), np.concatenate([mean[None], contact])


def _split_chunks(items: Sequence[T], size: int) -> list[Sequence[T]]:
    """The items in groups of at most `CHUNK_SIZE` bytes, or single ones; each item takes `size` bytes."""
    count = max(1, CHUNK_SIZE // max(size, 1))
    return [items[first : first + count] for first in range(0, len(items), count)]


def _with_stiffness(A: Array, moved: Array, D: Vector) -> Array:
    """Response of the directions with a stiffness D added to each: (I + A D)^-1 times their response without it."""
    return np.asarray(np.linalg.solve(np.eye(len(D)) + A * D, moved))
