"""A periodic force, and the response of a linear structure to it, frequency by frequency."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from fe.blas_threads import on_one_blas_thread
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.stop_reason import StopReason
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.errors import ForceError
from hbsolve.fourier import Coefficients, harmonics
from reduction.array_input import freeze_arrays, refuse_infinite
from reduction.array_type import Array, Real
from reduction.rom import ReducedModel


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicForce:
    """Fourier coefficients of an excitation, in the convention of `hbsolve.fourier`.

    Raises
    ------
    ForceError
        Another shape, a value that is not finite, or a static load that is not real.
    """

    coefficients: Complex[Array, "harmonic r"]
    """Coefficients, shape (n_harmonic, r) [N]: harmonic 0 (the static load, real), 1, ..., H on each degree of freedom.
    """

    def __post_init__(self) -> None:
        freeze_arrays(self, "coefficients", dtype=np.complex128)
        coefficients = self.coefficients
        if coefficients.ndim != 2 or not coefficients.size:
            raise ForceError(
                f"force coefficients have shape {coefficients.shape}: give (n_harmonic, degrees of freedom)"
            )
        refuse_infinite(coefficients, "the force", ForceError)
        if np.any(coefficients[0].imag != 0):
            row = int(np.flatnonzero(coefficients[0].imag)[0])
            raise ForceError(
                f"the static force on row {row} is {coefficients[0, row]:g} N: harmonic 0 is a mean and must be real"
            )

    @property
    def n_harmonic(self) -> int:
        """Number of harmonics with the mean, H + 1 [-]."""
        return len(self.coefficients)


@on_one_blas_thread
def forced_response(
    model: ReducedModel | DynamicStiffness, force: HarmonicForce, angular_frequency: Float[Real, " p"]
) -> ResponseBranch:
    """Periodic response in harmonics 0 to H at each excitation frequency.

    Parameters
    ----------
    model
        A reduced model, or a `DynamicStiffness` of matrices; the latter keeps its modes, which saves time in repeated
        calls.
    force
        Excitation; its harmonics are those of the response.
    angular_frequency
        Omega, shape (p,) [rad/s], positive.

    Raises
    ------
    ForceError
        A force on another number of degrees of freedom, a frequency that is not positive, a static force on a body
        without support, or an undamped resonance.
    ModelError
        Matrices that describe no vibrating structure.
    """
    structure = DynamicStiffness.of(model)
    if force.coefficients.shape[1] != structure.n_dof:
        raise ForceError(
            f"the force acts on {force.coefficients.shape[1]} degrees of freedom, the model has {structure.n_dof}: "
            "give coefficients of shape (n_harmonic, model's degrees of freedom)"
        )
    omega = np.atleast_1d(np.asarray(angular_frequency, dtype=np.float64))
    wrong = omega[~(np.isfinite(omega) & (omega > 0))]
    if wrong.size:
        raise ForceError(
            f"angular_frequency = {wrong[0]:g} rad/s must be positive: a static load is harmonic 0 of the force"
        )
    shape = force.coefficients.shape
    motions = [structure.response(harmonics(float(item), shape[0]), force.coefficients) for item in omega]
    return ResponseBranch(
        angular_frequency=omega,
        coefficients=np.array(motions).reshape(len(omega), *shape),
        residual_norm=np.array(
            [
                _compute_imbalance(structure, force, float(item), motion)
                for item, motion in zip(omega, motions, strict=True)
            ]
        ),
        stop_reason=StopReason.SOLVED,
    )


def _compute_imbalance(
    structure: DynamicStiffness, force: HarmonicForce, angular_frequency: float, motion: Coefficients
) -> float:
    """Imbalance of forces over the applied force, from the matrices and not from the modes [-]."""
    needed = structure.force(harmonics(angular_frequency, force.n_harmonic), motion)
    applied = float(np.linalg.norm(force.coefficients))
    return float(np.linalg.norm(needed - force.coefficients)) / applied if applied else 0.0
