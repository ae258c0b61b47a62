"""Receptance at any frequency from one modal decomposition."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from fe.dense_modes import DenseModes, compute_dense_modes
from hbsolve.coupled_damping import proportional_but_few
from hbsolve.diagonal_but_few import MOST, diagonal_but_few
from hbsolve.errors import ForceError, ModelError
from reduction.array_input import real_array, refuse_asymmetric, refuse_infinite, refuse_massless
from reduction.array_type import Array, Matrix, Real, Whole
from reduction.rom import ReducedModel

Frequencies = Float[Real, " p"]
Amplitudes = Complex[Array, "p r"]
Condensed = Complex[Array, "p d d"]
Rows = Int[Whole, " k"]

#: Modal damping couples two modes if |c_ij| exceeds this share of sqrt(c_ii c_jj), ...
COUPLED = 1e-6
#: ... and this share of the largest |c_ij|: what projecting a large stiffness onto soft shapes leaves as round-off.
ROUND_OFF = 1e-9
#: lambda / (lambda + sigma) of a rigid-body motion; that of the lowest elastic mode is 1/2.
RIGID = 1e-6
#: |1 - (sigma + omega^2) mu| of a mode that is hit exactly: round-off.
RESONANCE = 1e-14


@dataclass(frozen=True, kw_only=True, eq=False)
class DynamicStiffness:
    r"""Mass, damping and stiffness, and the receptance that inverts them.

    .. math:: \alpha(\omega) = (K - \omega^2 M + i (\omega C + H))^{-1}

    with the structural damping H of a complex stiffness, which acts on all motions but the mean. The receptances of
    harmonics k of Omega are those at omega = k Omega.

    With damping that does not couple the modes (Rayleigh, modal) one decomposition serves all frequencies: in the
    coordinates of `fe.dense_modes` the bracket is diagonal. So it does with Rayleigh damping that a few directions are
    out of proportion to, see `hbsolve.coupled_damping`. Any other damping takes one dense complex solve per frequency;
    the results are the same to round-off.

    Parameters
    ----------
    mass
        Symmetric positive definite, shape (r, r) [kg].
    damping
        Shape (r, r) [N s/m].
    stiffness
        Symmetric positive semi-definite, shape (r, r) [N/m]: singular for a body that contacts alone hold.
    basis
        Mode shapes of a structure nearby, shape (r, r), in which all three matrices may be diagonal but for few
        directions where its own modes are coupled; none by default.
    structural
        H, the imaginary part of a complex stiffness, shape (r, r) [N/m]; none by default.

    Raises
    ------
    ModelError
        Matrices of other shapes, not real, not finite, not symmetric, or indefinite.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eq. 12.
    """

    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    basis: Matrix | None = None
    structural: Matrix | None = None
    _modes: DenseModes = field(init=False, repr=False)
    #: V, shape (r, r), and the diagonals of V^T (K + sigma M) V, and of M, C and H likewise, shape (4, r), with sigma.
    _shapes: Matrix = field(init=False, repr=False)
    _diagonals: Matrix = field(init=False, repr=False)
    _shift: float = field(init=False, repr=False)
    #: What couples the modes beside it: V^T U, shape (r, k), and its strength in K, M, C and H, shape (4, k).
    _coupling: tuple[Matrix, Matrix] = field(init=False, repr=False)
    #: Whether each frequency takes a dense solve, because the damping couples all modes.
    damping_couples_modes: bool = field(init=False)
    #: The directions that were asked for last, and the modes as these see them: at each frequency they are the same.
    _last_seen: tuple[Matrix, Matrix] | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        for name in ("mass", "damping", "stiffness", *(() if self.structural is None else ("structural",))):
            matrix = real_array(getattr(self, name), f"the {name}", ModelError)
            object.__setattr__(self, name, matrix)
            if matrix.shape != self.mass.shape or matrix.shape != matrix.shape[:1] * 2 or not matrix.size:
                raise ModelError(
                    f"the {name} has shape {matrix.shape}, the mass {self.mass.shape}: give three square matrices of "
                    "one size"
                )
            refuse_infinite(matrix, f"the {name}", ModelError)
        for name in ("mass", "stiffness"):
            refuse_asymmetric(getattr(self, name), f"the {name}", ModelError)
        refuse_massless(self.mass, ModelError)
        try:
            modes = compute_dense_modes(self.mass, self.stiffness)
        except np.linalg.LinAlgError as error:
            raise ModelError(
                f"mass and stiffness have no modes ({error}): the stiffness must have no negative eigenvalue"
            ) from error
        object.__setattr__(self, "_modes", modes)
        modal_damping = modes.shapes.T @ self.damping @ modes.shapes
        modal_structural = np.zeros((1, self.n_dof))
        if self.structural is not None:
            modal_structural = modes.shapes.T @ self.structural @ modes.shapes
        shapes, own, coupling = modes.shapes, np.diag(modal_damping), (np.zeros((self.n_dof, 0)), np.zeros((4, 0)))
        hysteresis = modal_structural[0] if self.structural is None else np.diag(modal_structural)
        diagonals, shift = np.array([np.ones(self.n_dof), modes.mu, own, hysteresis]), modes.shift
        coupled = _is_coupled(modal_damping)
        if coupled and (result := proportional_but_few(self.mass, self.damping, self.stiffness)) is not None:
            proportional = result.mass_factor * modes.mu + result.stiffness_factor * (1 - modes.shift * modes.mu)
            U, s = modes.shapes.T @ result.directions, result.strength
            # Beside a stiff degree of freedom round-off may hide a dashpot; the modes, which are soft, show it.
            coupled = _is_coupled(modal_damping - (U * s) @ U.T, np.diag(modal_damping))
            if not coupled:
                diagonals[2], coupling = proportional, (U, np.array([0 * s, 0 * s, s, 0 * s]))
        coupled = coupled or (self.structural is not None and _is_coupled(modal_structural))
        if coupled and self.basis is not None and (found := self._in_basis(self.basis)) is not None:
            coupled, shapes, (diagonals, coupling), shift = False, self.basis, found, 0.0
        object.__setattr__(self, "_shapes", shapes)
        object.__setattr__(self, "_diagonals", diagonals)
        object.__setattr__(self, "_shift", shift)
        object.__setattr__(self, "_coupling", coupling)
        object.__setattr__(self, "damping_couples_modes", coupled)

    def _in_basis(self, basis: Matrix) -> tuple[Matrix, tuple[Matrix, Matrix]] | None:
        """Diagonals of the matrices in a basis, and the few directions beside; None where there are more."""
        matrices = [self.stiffness, self.mass, self.damping, *(() if self.structural is None else (self.structural,))]
        parts = [diagonal_but_few(basis.T @ matrix @ basis) for matrix in matrices]
        found = [part for part in parts if part is not None]
        count = np.array([len(part.strength) for part in found])
        if len(found) < len(parts) or count.sum() > MOST:
            return None
        strength, diagonals = np.zeros((4, count.sum())), np.zeros((4, self.n_dof))
        strength[np.repeat(np.arange(len(parts)), count), np.arange(count.sum())] = np.concatenate(
            [part.strength for part in found]
        )
        directions = np.concatenate([part.directions for part in found], axis=1)
        diagonals[: len(parts)] = [part.diagonal for part in found]
        return diagonals, (directions, strength)

    @classmethod
    def of(cls, model: "ReducedModel | DynamicStiffness") -> "DynamicStiffness":
        """That of a reduced model, or the model itself if it is one already."""
        if isinstance(model, cls):
            return model
        return cls(mass=model.mass, damping=model.damping, stiffness=model.stiffness)

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom r [-]."""
        return len(self.mass)

    @property
    def modes(self) -> DenseModes:
        """Modes of mass and stiffness."""
        return self._modes

    @cached_property
    def n_rigid(self) -> int:
        """Number of rigid-body motions: directions in which the stiffness resists nothing [-]."""
        return int(np.count_nonzero(1 - self._modes.shift * self._modes.mu < RIGID))

    def receptance(
        self, angular_frequency: Frequencies, rows: Rows | None = None, columns: Rows | None = None
    ) -> Complex[Array, "p k l"]:
        """Displacement of the rows for a unit force on each of the columns, shape (p, k, l) [m/N].

        It is symmetric if the damping is.

        Parameters
        ----------
        angular_frequency
            omega, shape (p,) [rad/s]; `hbsolve.fourier.harmonics` gives those of the harmonics of Omega.
        rows, columns
            Degrees of freedom, shapes (k,) and (l,) [-]; all by default. One that the model does not have is a
            `ModelError`.

        Raises
        ------
        ForceError
            A static receptance (omega = 0) of a body that nothing holds, or an undamped resonance.
        """
        omega = np.asarray(angular_frequency, dtype=np.float64)
        chosen_rows, chosen_columns = self._chosen(rows), self._chosen(columns)
        if self.damping_couples_modes:
            unit = np.eye(self.n_dof)[:, chosen_columns]
            full = self.moved(omega, np.broadcast_to(unit, (len(omega), *unit.shape)))
            return np.asarray(full[:, chosen_rows])
        V = self._shapes
        moved = self._modal_response(
            omega, np.broadcast_to(V[chosen_columns][:, None, :], (len(chosen_columns), len(omega), self.n_dof))
        )
        return np.asarray(np.moveaxis(moved @ V[chosen_rows].T, 0, 2))

    def response(self, angular_frequency: Frequencies, force: Complex[Array, "... p r"]) -> Complex[Array, "... p r"]:
        """Displacement alpha(omega) f for one or several force vectors at each frequency, without forming alpha.

        Parameters
        ----------
        angular_frequency
            omega, shape (p,) [rad/s].
        force
            Complex amplitudes, shape (p, r), or (n, p, r) [N].

        Returns
        -------
        Array of the shape of the force [m]; exactly zero where the force is, also statically without a support.

        Raises
        ------
        ForceError
            A static force on a body without support, or an undamped resonance.
        """
        omega = np.asarray(angular_frequency, dtype=np.float64)
        displacement = np.zeros(force.shape, dtype=np.complex128)
        loaded = np.any(force != 0, axis=(*range(force.ndim - 2), -1))
        if not loaded.any():
            return displacement
        omega, force = omega[loaded], force[..., loaded, :]
        if self.damping_couples_modes:
            # One factorisation a frequency, whatever the number of forces.
            columns = np.moveaxis(force.reshape(-1, *force.shape[-2:]), 0, 2)
            moved = self.moved(omega, columns)
            displacement[..., loaded, :] = np.moveaxis(moved, 2, 0).reshape(force.shape)
        else:
            V = self._shapes
            displacement[..., loaded, :] = _times(self._modal_response(omega, _times(force, V)), V.T)
        return displacement

    def moved(self, angular_frequency: Frequencies, columns: Complex[Array, "p r n"]) -> Complex[Array, "p r n"]:
        """Displacement under several forces at each frequency by one dense solve, whatever the damping [m].

        Parameters
        ----------
        angular_frequency
            omega, shape (p,) [rad/s].
        columns
            Forces, shape (p, r, n) [N].
        """
        return np.asarray(np.linalg.solve(self._matrices(np.asarray(angular_frequency, dtype=np.float64)), columns))

    def static_response(self, force: Complex[Array, "... r"]) -> Amplitudes:
        """Displacement K^-1 f of a supported body, shape (n, r) [m].

        Parameters
        ----------
        force
            f, shape (n, r) [N].

        Raises
        ------
        ForceError
            A body without support.
        """
        self._refuse_free_static(np.zeros(1))
        # Real and imaginary parts beside each other: a complex right side would make the factor complex.
        n = len(force)
        moved = cho_solve(self._factor, np.concatenate([force.real, force.imag]).T, check_finite=False).T
        return np.asarray(moved[:n] + 1j * moved[n:])

    @cached_property
    def _factor(self) -> tuple[Real, bool]:
        factor, lower = cho_factor(self.stiffness)
        return factor, bool(lower)

    def restrained(
        self,
        angular_frequency: Frequencies,
        force: Complex[Array, "... p r"],
        directions: Float[Real, "d r"],
        reaction: Callable[[Array], Array],
    ) -> Complex[Array, "... p r"]:
        """Response to a force and to what answers the motion that it would make, of modes that damping leaves alone.

        Parameters
        ----------
        angular_frequency, force
            As for `response`; several forces at once have shape (n, p, r).
        directions
            B, shape (d, r) [-].
        reaction
            Function of the displacement of the directions under the force alone, shape (..., p, d) [m]; it returns the
            forces against them, of the same shape [N].

        Returns
        -------
        Array of the shape of the force [m].

        Raises
        ------
        ForceError
            As `response`.
        """
        omega, V = np.asarray(angular_frequency, dtype=np.float64), self._shapes
        seen = self._seen(directions)
        alone = self._modal_response(omega, _times(force, V))
        return _times(alone - self._modal_response(omega, _times(reaction(_times(alone, seen.T)), seen)), V.T)

    def seen(
        self,
        angular_frequency: Frequencies,
        rows: Float[Real, "s r"],
        directions: Float[Real, "d r"],
        force: Amplitudes,
    ) -> tuple[Complex[Array, "p s d"], Complex[Array, "p s"]]:
        """What rows of the displacement see, of modes that damping leaves alone: reciprocity takes a response per row.

        Parameters
        ----------
        angular_frequency, directions, force
            As for `condensed`.
        rows
            Of the displacement, shape (s, r) [-].

        Returns
        -------
        Under a unit force along each direction [m/N], and under the force [m].

        Raises
        ------
        ForceError
            As `receptance`.
        """
        omega, V = np.asarray(angular_frequency, dtype=np.float64), self._shapes
        unit = np.broadcast_to((rows @ V)[:, None, :], (len(rows), len(omega), self.n_dof))
        moved = np.moveaxis(self._modal_response(omega, unit), 0, 1)
        return _times(moved, self._seen(directions).T), (moved @ _times(force, V)[..., None])[..., 0]

    def force(self, angular_frequency: Frequencies, displacement: Amplitudes) -> Amplitudes:
        """The force (K - omega^2 M + i (omega C + H)) q of a motion; the inverse of `response`, shape (p, r) [N]."""
        omega = np.asarray(angular_frequency, dtype=np.float64)[:, None]
        elastic, inertial = displacement @ self.stiffness.T, displacement @ self.mass.T
        force = elastic - omega**2 * inertial + 1j * omega * (displacement @ self.damping.T)
        if self.structural is not None:
            force += 1j * (omega > 0) * (displacement @ self.structural.T)
        return np.asarray(force)

    def condensed(
        self, angular_frequency: Frequencies, directions: Float[Real, "d r"], force: Amplitudes
    ) -> tuple[Condensed, Amplitudes]:
        r"""Receptance between directions and response to a force in them.

        .. math:: A = B \alpha B^T, \quad x = B \alpha f

        Parameters
        ----------
        angular_frequency
            omega, shape (p,) [rad/s].
        directions
            B, shape (d, r) [-].
        force
            f, shape (p, r) [N].

        Returns
        -------
        A, shape (p, d, d) [m/N], and x, shape (p, d) [m].

        Raises
        ------
        ForceError
            As `receptance`.
        """
        omega, B = np.asarray(angular_frequency, dtype=np.float64), np.asarray(directions)
        if self.damping_couples_modes:
            value = B @ self.moved(omega, beside(B, force))
            return value[..., :-1], value[..., -1]
        seen, modal_force = self._seen(B), _times(force, self._shapes)
        if not self._coupling[1].size:
            moves = 1 / self._diagonal(omega)
            return _between(seen, moves), _times(moves * modal_force, seen.T)
        value = np.swapaxes(_times(self._moved(omega, seen, modal_force), seen.T), 1, 2)
        return value[..., :-1], value[..., -1]

    def condensed_with_slopes(
        self, angular_frequency: Frequencies, directions: Float[Real, "d r"], force: Amplitudes
    ) -> tuple[Condensed, Condensed, Amplitudes, Amplitudes]:
        r"""`condensed` with derivatives in omega.

        .. math:: dA/d\omega = -B \alpha (i C - 2 \omega M) \alpha B^T

        Parameters
        ----------
        angular_frequency, directions, force
            As for `condensed`.

        Returns
        -------
        A [m/N] and dA/domega, shape (p, d, d), x [m] and dx/domega, shape (p, d).

        Raises
        ------
        ForceError
            As `receptance`.
        """
        omega, B = np.asarray(angular_frequency, dtype=np.float64), np.asarray(directions)
        d = len(B)
        if self.damping_couples_modes:
            matrices = self._matrices(omega)
            slopes = 1j * self.damping - 2 * omega[:, None, None] * self.mass
            moved = np.linalg.solve(matrices, beside(B, force))
            value = B @ moved
            slope = -B @ np.linalg.solve(matrices, slopes @ moved)
            return value[..., :d], slope[..., :d], value[..., d], slope[..., d]
        seen, modal_force = self._seen(B), _times(force, self._shapes)
        # The matrix is symmetric, and so is what it moves: alpha (dZ / domega) alpha needs no solution more.
        slope, (U, s) = _slope(omega, self._diagonals), self._coupling
        if not s.size:
            moves = 1 / self._diagonal(omega)
            turns = -slope[:, 0] * moves**2
            pairs = ((_between(seen, item), _times(item * modal_force, seen.T)) for item in (moves, turns))
            (value, x), (rate, dx) = pairs
            return value, rate, x, dx
        moved = self._moved(omega, seen, modal_force)
        mixed = moved * slope + _times(_times(moved, U) * _slope(omega, s), U.T)
        back = np.swapaxes(moved[:, :d], 1, 2)
        value, rate = np.swapaxes(_times(moved, seen.T), 1, 2), -np.swapaxes(mixed @ back, 1, 2)
        return value[..., :d], rate[..., :d], value[..., d], rate[..., d]

    def _moved(self, omega: Frequencies, seen: Matrix, modal_force: Amplitudes) -> Complex[Array, "p d r"]:
        """Modal response to a unit force along each direction, and last to the force, shape (p, d + 1, r)."""
        unit = np.broadcast_to(seen[:, None, :], (len(seen), len(omega), self.n_dof))
        return np.moveaxis(self._modal_response(omega, np.concatenate([unit, modal_force[None]])), 0, 1)

    def _seen(self, directions: Matrix) -> Matrix:
        """The modes as some directions see them, B V."""
        if self._last_seen is None or self._last_seen[0] is not directions:
            object.__setattr__(self, "_last_seen", (directions, directions @ self._shapes))
        assert self._last_seen is not None
        return self._last_seen[1]

    def _modal_response(
        self, omega: Frequencies, force: Complex[Array, "... p r"] | Float[Real, "... p r"]
    ) -> Complex[Array, "... p r"]:
        """(V^T Z V)^-1 f of modal forces: a division for each mode, and what couples them by Woodbury's formula."""
        diagonal, (U, s) = self._diagonal(omega), self._coupling
        alone = force / diagonal
        if not s.size:
            return np.asarray(alone)
        strength = _at(omega, s)[:, :, None]
        small = np.eye(U.shape[1]) + strength * ((U.T / diagonal[:, None, :]) @ U)
        pushed = np.linalg.solve(small, strength * _times(alone, U)[..., None])[..., 0]
        moved = _times(pushed, U.T)
        moved /= diagonal
        return np.asarray(alone - moved)

    def _diagonal(self, omega: Frequencies) -> Amplitudes:
        """V^T Z V but for what couples the modes, k - omega^2 m + i omega c, shape (p, r)."""
        self._refuse_free_static(omega)
        diagonal = _at(omega, self._diagonals, self._shift)
        resonant = np.abs(diagonal) < RESONANCE
        if resonant.any():
            frequency, mode = np.argwhere(resonant)[0]
            raise ForceError(
                f"the force at {omega[frequency]:.6g} rad/s meets undamped mode {mode + 1} exactly: "
                "add damping, or shift the frequency"
            )
        return np.asarray(diagonal)

    def _matrices(self, omega: Frequencies) -> Complex[Array, "p r r"]:
        self._refuse_free_static(omega)
        w = omega[:, None, None]
        matrices = self.stiffness - w**2 * self.mass + 1j * w * self.damping
        if self.structural is not None:
            matrices += 1j * (w > 0) * self.structural
        return np.asarray(matrices)

    def _refuse_free_static(self, omega: Frequencies) -> None:
        if self.n_rigid and np.any(omega == 0):
            raise ForceError(
                f"a static force finds no resistance: the stiffness leaves {self.n_rigid} rigid-body motions free; "
                "hold the body, let a stuck contact's stiffness hold it, or leave the static force out"
            )

    def _chosen(self, rows: Rows | None) -> Rows:
        chosen = np.arange(self.n_dof) if rows is None else np.asarray(rows, dtype=np.int64)
        wrong = chosen[(chosen < 0) | (chosen >= self.n_dof)]
        if wrong.size:
            raise ModelError(f"row {wrong[0]} does not exist: the model has rows 0 to {self.n_dof - 1}")
        return chosen


def _at(omega: Frequencies, parts: Matrix, shift: float = 0.0) -> Amplitudes:
    """Parts of Z = K - omega^2 M + i (omega C + H), shape (p, n), from those of K + sigma M, M, C, H, shape (4, n)."""
    stiffness, mass, damping, structural = parts
    loss = np.outer(omega, damping)
    if structural.any():
        loss += np.outer(omega > 0, structural)
    return np.asarray(stiffness - np.outer(shift + omega**2, mass) + 1j * loss)


def _slope(omega: Frequencies, parts: Matrix) -> Complex[Array, "p 1 n"]:
    """Its derivative in omega."""
    _, mass, damping, _ = parts
    return np.asarray(1j * damping - 2 * omega[:, None, None] * mass)


def _times(vectors: NDArray[np.inexact[Any]], matrix: Matrix) -> Array:
    """Complex vectors times a real matrix, part by part: half the work of a complex product."""
    rows = vectors.reshape(int(np.prod(vectors.shape[:-1])), vectors.shape[-1])
    result = np.empty((len(rows), matrix.shape[1]), dtype=np.complex128)
    result.real, result.imag = np.ascontiguousarray(rows.real) @ matrix, np.ascontiguousarray(rows.imag) @ matrix
    return result.reshape(*vectors.shape[:-1], matrix.shape[1])


def beside(B: Matrix, force: Amplitudes) -> Complex[Array, "p r d"]:
    """A unit force along each direction, and last the force, as columns at each frequency, shape (p, r, d + 1)."""
    return np.concatenate([np.broadcast_to(B.T, (len(force), *B.T.shape)), force[..., None]], axis=2)


def _between(seen: Matrix, moves: Amplitudes) -> Condensed:
    """B V diag(moves) V^T B^T at each frequency, shape (p, d, d)."""
    result = np.empty((len(moves), len(seen), len(seen)), dtype=np.complex128)
    for item, own in zip(result, moves, strict=True):
        item.real, item.imag = (seen * own.real) @ seen.T, (seen * own.imag) @ seen.T
    return result


def _is_coupled(modal_damping: Matrix, diagonal: Frequencies | None = None) -> bool:
    """Whether modes are coupled, beside the damping of each by itself; that of the matrix by default."""
    magnitude = np.abs(modal_damping)
    own = np.sqrt(np.abs(np.diag(magnitude) if diagonal is None else diagonal))
    allowed = np.maximum(COUPLED * np.outer(own, own), ROUND_OFF * magnitude.max())
    return bool(np.any((magnitude > allowed) & ~np.eye(len(magnitude), dtype=bool)))
