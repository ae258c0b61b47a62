r"""Coordinates in which a dynamic stiffness is diagonal plus low rank.

.. math:: V^T (K - \omega^2 M + i (\omega C + H)) V = \operatorname{diag}(k - \omega^2 m + i (\omega c + h)) + U S U^T

Mode shapes V are such coordinates where the damping does not couple them. The inverse is then a division per mode, and
the coupling by the few columns of U follows by Woodbury's formula: one decomposition serves all frequencies.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from fe.dense_modes import DenseModes
from hbsolve.coupled_damping import split_proportional_plus_low_rank
from hbsolve.diagonal_plus_low_rank import MAX_RANK, split_diagonal_plus_low_rank
from hbsolve.errors import ForceError
from reduction.array_type import Array, Matrix, Real

Frequencies = Float[Real, " p"]
Amplitudes = Complex[Array, "p r"]

#: Modal damping couples two modes if |c_ij| exceeds this fraction of sqrt(c_ii c_jj), ...
COUPLED_SHARE = 1e-6
#: ... and this fraction of the largest |c_ij|: the round-off of projecting a large stiffness onto soft shapes.
ROUND_OFF = 1e-9
#: |k - omega^2 m| of a mode that is hit exactly, over |k| + omega^2 |m|: round-off.
RESONANCE = 1e-14


@dataclass(frozen=True, kw_only=True, eq=False)
class ModalCoordinates:
    """Coordinates of r modes.

    Parameters
    ----------
    shapes
        V, shape (r, r).
    diagonals
        Diagonals of V^T (K + sigma M) V, and of M, C and H likewise, shape (4, r).
    shift
        sigma [rad^2/s^2].
    directions
        U, shape (r, k).
    strength
        Diagonals of S in K, M, C and H, shape (4, k).
    """

    shapes: Matrix
    diagonals: Matrix
    shift: float
    directions: Matrix
    strength: Matrix
    #: Rows of the last projection, and their projection: the rows are the same at each frequency.
    _last: tuple[Matrix, Matrix] | None = field(init=False, repr=False, default=None)

    def response(self, omega: Frequencies, force: Complex[Array, "... p r"]) -> Complex[Array, "... p r"]:
        """Displacement under one or several forces at each frequency [m].

        Parameters
        ----------
        omega
            Shape (p,) [rad/s].
        force
            Shape (..., p, r) [N].

        Raises
        ------
        ForceError
            An undamped resonance.
        """
        return _multiply(self._solve(omega, _multiply(force, self.shapes)), self.shapes.T)

    def receptance(
        self, omega: Frequencies, rows: Float[Real, "k r"], columns: Float[Real, "l r"]
    ) -> Complex[Array, "p k l"]:
        """Displacement of the rows under a unit force along each column [m/N]; errors as of `response`."""
        return np.moveaxis(self._unit_responses(omega, columns) @ (rows @ self.shapes).T, 0, 2)

    def condense_to_rows(
        self, omega: Frequencies, rows: Float[Real, "n r"], directions: Float[Real, "d r"], force: Amplitudes
    ) -> tuple[Complex[Array, "p n d"], Complex[Array, "p n"]]:
        """Displacement of few rows, by reciprocity from a response per row.

        Parameters
        ----------
        omega, force
            As of `response`.
        rows, directions
            Rows of the displacement, and directions of unit forces, shapes (n, r) and (d, r) [-].

        Returns
        -------
        Displacement under a unit force along each direction [m/N], and under the force [m].

        Raises
        ------
        ForceError
            An undamped resonance.
        """
        response = np.moveaxis(self._unit_responses(omega, rows), 0, 1)
        under_force = (response @ _multiply(force, self.shapes)[..., None])[..., 0]
        return _multiply(response, self.project(directions).T), under_force

    def response_with_reaction(
        self,
        omega: Frequencies,
        force: Complex[Array, "... p r"],
        directions: Float[Real, "d r"],
        reaction: Callable[[Array], Array],
    ) -> Complex[Array, "... p r"]:
        """Response to a force and to the reactions to its motion [m].

        Parameters
        ----------
        omega, force
            As of `response`.
        directions
            B, shape (d, r) [-].
        reaction
            Function of the displacement of the directions under the force alone, shape (..., p, d) [m]; it returns the
            forces against them, of the same shape [N].

        Raises
        ------
        ForceError
            An undamped resonance.
        """
        projected = self.project(directions)
        alone = self._solve(omega, _multiply(force, self.shapes))
        against = _multiply(reaction(_multiply(alone, projected.T)), projected)
        return _multiply(alone - self._solve(omega, against), self.shapes.T)

    def condense(
        self, omega: Frequencies, directions: Float[Real, "d r"], force: Amplitudes
    ) -> tuple[Complex[Array, "p d d"], Complex[Array, "p d"]]:
        """Receptance between directions [m/N] and their response to a force [m]; see `DynamicStiffness.condense`."""
        projected, modal_force, d = self.project(directions), _multiply(force, self.shapes), len(directions)
        receptance = 1 / self._diagonal(omega)
        rows = np.vstack([projected, self.directions.T])
        value, moved = _scale_and_project(rows, receptance), _multiply(receptance * modal_force, rows.T)
        if not self.strength.size:
            return value, moved
        against = np.concatenate([value[:, d:, :d], moved[:, d:, None]], axis=2)
        correction = value[:, :d, d:] @ self._couple(omega, value[:, d:, d:], against)
        return value[:, :d, :d] - correction[..., :d], moved[:, :d] - correction[..., d]

    def condense_with_slopes(
        self, omega: Frequencies, directions: Float[Real, "d r"], force: Amplitudes
    ) -> tuple[Complex[Array, "p d d"], Complex[Array, "p d d"], Complex[Array, "p d"], Complex[Array, "p d"]]:
        """`condense` with derivatives in omega; see `DynamicStiffness.condense_with_slopes`."""
        projected, modal_force, d = self.project(directions), _multiply(force, self.shapes), len(directions)
        slope = _compute_slope(omega, self.diagonals)
        if not self.strength.size:
            receptance = 1 / self._diagonal(omega)
            (value, x), (rate, dx) = (
                (_scale_and_project(projected, item), _multiply(item * modal_force, projected.T))
                for item in (receptance, -slope[:, 0] * receptance**2)
            )
            return value, rate, x, dx
        # The matrix is symmetric, and so is its inverse: alpha (dZ / domega) alpha needs no further solve.
        columns, U = self._solve_columns(omega, projected, modal_force), self.directions
        turned = columns * slope + _multiply(_multiply(columns, U) * _compute_slope(omega, self.strength), U.T)
        value = np.swapaxes(_multiply(columns, projected.T), 1, 2)
        rate = -np.swapaxes(turned @ np.swapaxes(columns[:, :d], 1, 2), 1, 2)
        return value[..., :d], rate[..., :d], value[..., d], rate[..., d]

    def project(self, rows: Matrix) -> Matrix:
        """Rows of the displacement in modal coordinates, B V, shape (n, r)."""
        if self._last is None or self._last[0] is not rows:
            object.__setattr__(self, "_last", (rows, rows @ self.shapes))
        assert self._last is not None
        return self._last[1]

    def _unit_responses(self, omega: Frequencies, rows: Float[Real, "n r"]) -> Complex[Array, "n p r"]:
        """Modal response to a unit force along each row."""
        unit = rows @ self.shapes
        return self._solve(omega, np.broadcast_to(unit[:, None, :], (len(rows), len(omega), unit.shape[1])))

    def _solve_columns(self, omega: Frequencies, projected: Matrix, modal_force: Amplitudes) -> Complex[Array, "p d r"]:
        """Modal response to a unit force along each direction, and last to the force, shape (p, d + 1, r)."""
        unit = np.broadcast_to(projected[:, None, :], (len(projected), *modal_force.shape))
        return np.moveaxis(self._solve(omega, np.concatenate([unit, modal_force[None]])), 0, 1)

    def _solve(
        self, omega: Frequencies, force: Complex[Array, "... p r"] | Float[Real, "... p r"]
    ) -> Complex[Array, "... p r"]:
        """(V^T Z V)^-1 f of modal forces: a division per mode, and the coupling by Woodbury's formula."""
        diagonal, U = self._diagonal(omega), self.directions
        alone = force / diagonal
        if not self.strength.size:
            return np.asarray(alone)
        count = int(np.prod(alone.shape[:-2]))
        along = np.moveaxis(_multiply(alone, U).reshape(count, len(omega), U.shape[1]), 0, 2)
        coupling = np.moveaxis(self._couple(omega, (U.T / diagonal[:, None, :]) @ U, along), 2, 0)
        correction = _multiply(coupling, U.T).reshape(alone.shape)
        correction /= diagonal
        return np.asarray(alone - correction)

    def _couple(
        self, omega: Frequencies, receptance: Complex[Array, "p k k"], along: Complex[Array, "p k n"]
    ) -> Complex[Array, "p k n"]:
        """Forces along U that couple n responses, (I + S U^T D^-1 U)^-1 S U^T x, from U^T D^-1 U and U^T x."""
        strength = _combine(omega, self.strength)[:, :, None]
        return np.asarray(np.linalg.solve(np.eye(receptance.shape[-1]) + strength * receptance, strength * along))

    def _diagonal(self, omega: Frequencies) -> Amplitudes:
        """Diagonals k - omega^2 m + i (omega c + h), shape (p, r)."""
        diagonal = _combine(omega, self.diagonals, self.shift)
        size = np.abs(self.diagonals[0]) + np.outer(self.shift + omega**2, np.abs(self.diagonals[1]))
        resonant = np.abs(diagonal) < RESONANCE * size
        if resonant.any():
            frequency, mode = np.argwhere(resonant)[0]
            raise ForceError(
                f"the force at {omega[frequency]:.6g} rad/s is exactly at the undamped mode {mode + 1}: add damping, "
                "or shift the frequency"
            )
        return np.asarray(diagonal)


def find_modal_coordinates(
    modes: DenseModes,
    mass: Matrix,
    damping: Matrix,
    stiffness: Matrix,
    structural: Matrix | None = None,
    basis: Matrix | None = None,
) -> ModalCoordinates | None:
    """Coordinates that uncouple M, C, K and H; None if the damping couples all modes.

    Parameters
    ----------
    modes
        Modes of mass and stiffness.
    mass, damping, stiffness, structural, basis
        As of `DynamicStiffness`.
    """
    matrices = [stiffness, mass, damping, *(() if structural is None else (structural,))]
    modal = modes.shapes.T @ damping @ modes.shapes
    hysteresis = np.zeros_like(modal) if structural is None else modes.shapes.T @ structural @ modes.shapes
    own, shift, U, s = np.diag(modal), modes.shift, np.zeros((len(mass), 0)), np.zeros(0)
    coupled = _is_coupled(modal)
    if coupled and (part := split_proportional_plus_low_rank(mass, damping, stiffness)) is not None:
        directions = modes.shapes.T @ part.directions
        # Beside a stiff degree of freedom round-off may hide a dashpot; the modes, which are soft, show it.
        coupled = _is_coupled(modal - (directions * part.strength) @ directions.T, own)
        if not coupled:
            own = part.mass_factor * modes.mu + part.stiffness_factor * (1 - shift * modes.mu)
            U, s = directions, part.strength
    if not coupled and not _is_coupled(hysteresis):
        diagonals = np.array([np.ones_like(own), modes.mu, own, np.diag(hysteresis)])
        strength = np.array([0 * s, 0 * s, s, 0 * s])
        return ModalCoordinates(shapes=modes.shapes, diagonals=diagonals, shift=shift, directions=U, strength=strength)
    return None if basis is None else _find_in_basis(matrices, basis)


def _find_in_basis(matrices: list[Matrix], basis: Matrix) -> ModalCoordinates | None:
    """Coordinates of a basis in which K, M, C and H are diagonal plus low rank; None if they are not."""
    parts = [split_diagonal_plus_low_rank(basis.T @ matrix @ basis) for matrix in matrices]
    result = [part for part in parts if part is not None]
    count = np.array([len(part.strength) for part in result])
    if len(result) < len(parts) or count.sum() > MAX_RANK:
        return None
    strength, diagonals = np.zeros((4, count.sum())), np.zeros((4, len(basis)))
    strength[np.repeat(np.arange(len(parts)), count), np.arange(count.sum())] = np.concatenate(
        [part.strength for part in result]
    )
    diagonals[: len(parts)] = [part.diagonal for part in result]
    directions = np.concatenate([part.directions for part in result], axis=1)
    return ModalCoordinates(shapes=basis, diagonals=diagonals, shift=0.0, directions=directions, strength=strength)


def _is_coupled(modal_damping: Matrix, diagonal: Float[Real, " r"] | None = None) -> bool:
    """Whether modal damping couples modes; `diagonal` is the damping of each mode, by default that of the matrix."""
    magnitude = np.abs(modal_damping)
    own = np.sqrt(np.abs(np.diag(magnitude) if diagonal is None else diagonal))
    allowed = np.maximum(COUPLED_SHARE * np.outer(own, own), ROUND_OFF * magnitude.max())
    return bool(np.any((magnitude > allowed) & ~np.eye(len(magnitude), dtype=bool)))


def _combine(omega: Frequencies, parts: Matrix, shift: float = 0.0) -> Amplitudes:
    """Parts of Z = K - omega^2 M + i (omega C + H), shape (p, n), from those of K + sigma M, M, C, H, shape (4, n)."""
    stiffness, mass, damping, structural = parts
    loss = np.outer(omega, damping)
    if structural.any():
        loss += np.outer(omega > 0, structural)
    return np.asarray(stiffness - np.outer(shift + omega**2, mass) + 1j * loss)


def _compute_slope(omega: Frequencies, parts: Matrix) -> Complex[Array, "p 1 n"]:
    """Derivative of `_combine` in omega."""
    _, mass, damping, _ = parts
    return np.asarray(1j * damping - 2 * omega[:, None, None] * mass)


def _multiply(vectors: NDArray[np.inexact[Any]], matrix: Matrix) -> Array:
    """Complex vectors times a real matrix, part by part: half the work of a complex product."""
    rows = vectors.reshape(int(np.prod(vectors.shape[:-1])), vectors.shape[-1])
    result = np.empty((len(rows), matrix.shape[1]), dtype=np.complex128)
    result.real, result.imag = np.ascontiguousarray(rows.real) @ matrix, np.ascontiguousarray(rows.imag) @ matrix
    return result.reshape(*vectors.shape[:-1], matrix.shape[1])


def _scale_and_project(projected: Matrix, receptance: Amplitudes) -> Complex[Array, "p d d"]:
    """B V diag(receptance) V^T B^T at each frequency, shape (p, d, d).

    It is symmetric. At many frequencies one product per row takes less time than one per frequency.
    """
    p, d = len(receptance), len(projected)
    result = np.empty((p, d, d), dtype=np.complex128)
    if p < d:
        for item, own in zip(result, receptance, strict=True):
            item.real, item.imag = (projected * own.real) @ projected.T, (projected * own.imag) @ projected.T
        return result
    parts = np.concatenate([receptance.real, receptance.imag])
    for row in range(d):
        products = parts @ (projected[row] * projected[row:]).T
        result.real[:, row, row:] = result.real[:, row:, row] = products[:p]
        result.imag[:, row, row:] = result.imag[:, row:, row] = products[p:]
    return result
