"""Receptance at any frequency from one modal decomposition."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.linalg import cho_factor, cho_solve

from fe.dense_modes import DenseModes, compute_dense_modes
from hbsolve.errors import ForceError, ModelError
from hbsolve.modal_coordinates import ModalCoordinates, find_modal_coordinates
from reduction.array_input import check_array, refuse_asymmetric, refuse_infinite, refuse_massless
from reduction.array_type import Array, Matrix, Real, Whole
from reduction.rom import ReducedModel

Frequencies = Float[Real, " p"]
Amplitudes = Complex[Array, "p r"]
Condensed = Complex[Array, "p d d"]
Rows = Int[Whole, " k"]

#: Largest lambda / (lambda + sigma) of a rigid-body motion; that of the lowest elastic mode is 1/2.
RIGID = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class DynamicStiffness:
    r"""Mass, damping and stiffness, and the receptance that inverts them.

    .. math:: \alpha(\omega) = (K - \omega^2 M + i (\omega C + H))^{-1}

    with the structural damping H of a complex stiffness, which acts on all motions but the mean. The receptances of
    harmonics k of Omega are those at omega = k Omega.

    With damping that does not couple the modes (Rayleigh, modal), or couples them in few directions, one decomposition
    serves all frequencies, see `hbsolve.modal_coordinates`. Any other damping takes one dense complex solve per
    frequency; the results are the same to round-off.

    Parameters
    ----------
    mass
        Mass, symmetric positive definite, shape (r, r) [kg].
    damping
        Damping, shape (r, r) [N s/m].
    stiffness
        Stiffness, symmetric positive semi-definite, shape (r, r) [N/m]: singular for a body held by contacts alone.
    basis
        Mode shapes of a similar structure, shape (r, r), used if the damping couples the modes of this one and all
        matrices are diagonal plus low rank in these shapes; none by default.
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
    #: Modes of mass and stiffness.
    modes: DenseModes = field(init=False, repr=False)
    #: Coordinates that the damping does not couple; None if each frequency takes a dense solve.
    modal: ModalCoordinates | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("mass", "damping", "stiffness", *(() if self.structural is None else ("structural",))):
            matrix = check_array(getattr(self, name), f"the {name}", ModelError)
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
        object.__setattr__(self, "modes", modes)
        modal = find_modal_coordinates(
            modes, self.mass, self.damping, self.stiffness, structural=self.structural, basis=self.basis
        )
        object.__setattr__(self, "modal", modal)

    @classmethod
    def of(cls, model: "ReducedModel | DynamicStiffness") -> "DynamicStiffness":
        """The dynamic stiffness of a reduced model, or the model itself if it is one already."""
        if isinstance(model, cls):
            return model
        return cls(mass=model.mass, damping=model.damping, stiffness=model.stiffness)

    @property
    def n_dof(self) -> int:
        """Number of degrees of freedom r [-]."""
        return len(self.mass)

    @property
    def damping_couples_modes(self) -> bool:
        """Whether each frequency takes a dense solve, because the damping couples all modes."""
        return self.modal is None

    @cached_property
    def n_rigid(self) -> int:
        """Number of rigid-body motions, against which there is no stiffness [-]."""
        return int(np.count_nonzero(1 - self.modes.shift * self.modes.mu < RIGID))

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
            Degrees of freedom, shapes (k,) and (l,) [-]; all by default.

        Raises
        ------
        ForceError
            A static receptance (omega = 0) of an unsupported body, or an undamped resonance.
        ModelError
            A degree of freedom that the model does not have.
        """
        omega = self._check_frequencies(angular_frequency)
        chosen_rows, chosen_columns = self._check_rows(rows), self._check_rows(columns)
        unit = np.eye(self.n_dof)
        if self.modal is not None:
            return self.modal.receptance(omega, unit[chosen_rows], unit[chosen_columns])
        force = np.broadcast_to(unit[:, chosen_columns], (len(omega), self.n_dof, len(chosen_columns)))
        return np.asarray(self.solve(omega, force.astype(np.complex128))[:, chosen_rows])

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
        omega, force = self._check_frequencies(omega[loaded]), force[..., loaded, :]
        if self.modal is not None:
            displacement[..., loaded, :] = self.modal.response(omega, force)
            return displacement
        # One factorisation per frequency, whatever the number of forces.
        columns = np.moveaxis(force.reshape(-1, *force.shape[-2:]), 0, 2)
        displacement[..., loaded, :] = np.moveaxis(self.solve(omega, columns), 2, 0).reshape(force.shape)
        return displacement

    def solve(self, angular_frequency: Frequencies, columns: Complex[Array, "p r n"]) -> Complex[Array, "p r n"]:
        """Displacement under several forces at each frequency by one dense solve, whatever the damping [m].

        Parameters
        ----------
        angular_frequency
            omega, shape (p,) [rad/s].
        columns
            Forces, shape (p, r, n) [N].
        """
        return np.asarray(np.linalg.solve(self._evaluate(self._check_frequencies(angular_frequency)), columns))

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
        self._check_frequencies(np.zeros(1))
        # Real and imaginary parts as separate columns: a complex right side would make the factor complex.
        n = len(force)
        parts = cho_solve(self._factor, np.concatenate([force.real, force.imag]).T, check_finite=False).T
        return np.asarray(parts[:n] + 1j * parts[n:])

    @cached_property
    def _factor(self) -> tuple[Real, bool]:
        factor, lower = cho_factor(self.stiffness)
        return factor, bool(lower)

    def force(self, angular_frequency: Frequencies, displacement: Amplitudes) -> Amplitudes:
        """Force (K - omega^2 M + i (omega C + H)) q of a motion, the inverse of `response`, shape (p, r) [N]."""
        omega = np.asarray(angular_frequency, dtype=np.float64)[:, None]
        elastic, inertial = displacement @ self.stiffness.T, displacement @ self.mass.T
        force = elastic - omega**2 * inertial + 1j * omega * (displacement @ self.damping.T)
        if self.structural is not None:
            force += 1j * (omega > 0) * (displacement @ self.structural.T)
        return np.asarray(force)

    def condense(
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
        omega, B = self._check_frequencies(angular_frequency), np.asarray(directions)
        if self.modal is not None:
            return self.modal.condense(omega, B, force)
        value = B @ self.solve(omega, stack_unit_forces_and_force(B, force))
        return value[..., :-1], value[..., -1]

    def condense_with_slopes(
        self, angular_frequency: Frequencies, directions: Float[Real, "d r"], force: Amplitudes
    ) -> tuple[Condensed, Condensed, Amplitudes, Amplitudes]:
        r"""`condense` with derivatives in omega.

        .. math:: dA/d\omega = -B \alpha (i C - 2 \omega M) \alpha B^T

        Parameters
        ----------
        angular_frequency, directions, force
            As for `condense`.

        Returns
        -------
        A [m/N] and dA/domega, shape (p, d, d), x [m] and dx/domega, shape (p, d).

        Raises
        ------
        ForceError
            As `receptance`.
        """
        omega, B = self._check_frequencies(angular_frequency), np.asarray(directions)
        if self.modal is not None:
            return self.modal.condense_with_slopes(omega, B, force)
        matrices, d = self._evaluate(omega), len(B)
        slopes = 1j * self.damping - 2 * omega[:, None, None] * self.mass
        columns = np.linalg.solve(matrices, stack_unit_forces_and_force(B, force))
        value = B @ columns
        slope = -B @ np.linalg.solve(matrices, slopes @ columns)
        return value[..., :d], slope[..., :d], value[..., d], slope[..., d]

    def _evaluate(self, omega: Frequencies) -> Complex[Array, "p r r"]:
        w = omega[:, None, None]
        matrices = self.stiffness - w**2 * self.mass + 1j * w * self.damping
        if self.structural is not None:
            matrices += 1j * (w > 0) * self.structural
        return np.asarray(matrices)

    def _check_frequencies(self, angular_frequency: Frequencies) -> Frequencies:
        """Return the frequencies; refuse a static one for an unsupported body."""
        omega = np.asarray(angular_frequency, dtype=np.float64)
        if self.n_rigid and np.any(omega == 0):
            raise ForceError(
                f"a static force meets no stiffness: {self.n_rigid} rigid-body motions are free; support the body, "
                "let the stiffness of a stuck contact hold it, or remove the static force"
            )
        return omega

    def _check_rows(self, rows: Rows | None) -> Rows:
        chosen = np.arange(self.n_dof) if rows is None else np.asarray(rows, dtype=np.int64)
        wrong = chosen[(chosen < 0) | (chosen >= self.n_dof)]
        if wrong.size:
            raise ModelError(f"row {wrong[0]} does not exist: the model has rows 0 to {self.n_dof - 1}")
        return chosen


def stack_unit_forces_and_force(B: Matrix, force: Amplitudes) -> Complex[Array, "p r d"]:
    """A unit force along each direction, and last the force, as columns at each frequency, shape (p, r, d + 1)."""
    return np.concatenate([np.broadcast_to(B.T, (len(force), *B.T.shape)), force[..., None]], axis=2)
