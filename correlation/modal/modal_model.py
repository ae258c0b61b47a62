r"""Poles and residues of frequency responses by weighted least squares, with their covariance.

The receptance between one force and the sensors c is

.. math:: H_c(\omega) = \sum_m \left( \frac{R_{cm}}{i \omega - p_m} + \frac{\bar R_{cm}}{i \omega - \bar p_m} \right)
          + \frac{L_c}{\omega^2} + U_c

with residual terms of the modes below and above the band; mobility and accelerance are it times :math:`i \omega` and
:math:`-\omega^2`. Residues and residual terms are linear and are solved for at every step, so that Gauss and Newton's
method moves the poles alone (variable projection).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

Poles = Complex[NDArray[np.complex128], " m"]
Responses = Complex[NDArray[np.complex128], "c f"]
Frequencies = Float[NDArray[np.float64], " f"]
Matrix = Float[NDArray[np.float64], "n p"]

#: Steps, and the step of a pole, as a share of its distance from the imaginary axis, that ends them.
ROUNDS, ENOUGH = 40, 1e-7
#: What is smaller beside a response is no reason for another mode: no measurement is linear to this share [-].
NEGLIGIBLE = 1e-4
#: Real numbers per sensor of the residual terms, of which L and U have two each.
RESIDUAL_TERMS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ModalFit:
    """Poles and residues.

    Parameters
    ----------
    poles
        Shape (m,) [rad/s].
    pole_covariance
        Of real and imaginary parts, all real parts first, shape (2 m, 2 m) [rad^2/s^2].
    residues, residue_deviation
        R, shape (c, m), and standard deviation of its real and imaginary parts alike.
    fitted
        Responses of the model, shape (c, f).
    noise
        Standard deviation of real and imaginary parts of what is left, by sensor, shape (c,).
    """

    poles: Poles
    pole_covariance: Matrix
    residues: Complex[NDArray[np.complex128], "c m"]
    residue_deviation: Float[NDArray[np.float64], "c m"]
    fitted: Responses
    noise: Float[NDArray[np.float64], " c"]

    def criterion(self) -> float:
        """Bayes's information criterion: the smaller the better."""
        c, f = self.fitted.shape
        count = 2 * len(self.poles) * (1 + c) + RESIDUAL_TERMS * c
        least = NEGLIGIBLE * np.sqrt((np.abs(self.fitted) ** 2).mean(axis=1)) + 1e-300
        return float(4 * f * np.log(np.maximum(self.noise, least)).sum() + count * np.log(2 * f * c))


def columns(frequency: Frequencies, poles: Poles, power: int) -> Matrix:
    """Real columns of residues (real parts, imaginary parts) and residual terms, real rows above imaginary ones."""
    s = 2j * np.pi * frequency[:, None]
    first, second = 1 / (s - poles), 1 / (s - poles.conj())
    size = np.abs(poles.imag).mean() if len(poles) else 2 * np.pi * frequency.mean()
    background = np.hstack([(size / np.abs(s)) ** 2, np.ones_like(s)]) / size
    basis = np.hstack([first + second, 1j * (first - second), background, 1j * background]) * s**power
    return np.vstack([basis.real, basis.imag])


def fit_poles(
    frequency: Frequencies, responses: Responses, poles: Poles, power: int, deviation: Responses | None = None
) -> ModalFit:
    """Poles and residues from first guesses of the poles.

    Parameters
    ----------
    frequency
        Shape (f,) [Hz].
    responses
        Shape (c, f).
    poles
        First guesses, shape (m,) [rad/s].
    power
        Of i omega by which the responses exceed a receptance: 0, 1 or 2.
    deviation
        Of real and imaginary part of the responses, shape (c, f); equal along each response by default.
    """
    values = np.hstack([responses.real, responses.imag])
    if deviation is None:
        weight = np.ones_like(values) / np.sqrt((values**2).mean(axis=1, keepdims=True))
    else:
        weight = np.hstack([1 / deviation, 1 / deviation]).real
    damping = 1e-3
    fit = _project(frequency, values, weight, poles, power)
    for _ in range(ROUNDS):
        if deviation is None:
            # Noise differs between sensors: each counts by what it leaves.
            weight = np.ones_like(values) / np.maximum(fit.noise[:, None], 1e-12 * np.abs(values).max())
            fit = _project(frequency, values, weight, poles, power)
        normal, right, square = fit.normal, fit.right, fit.square
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-300), right)
        m = len(poles)
        change = np.clip(step[:m] / -poles.real, -0.5, 0.5) * -poles.real
        turn = np.clip(step[m:] / -poles.real, -2, 2) * -poles.real
        trial_poles = poles + change + 1j * turn
        trial = _project(frequency, values, weight, trial_poles, power)
        if trial.square < square:
            poles, fit, damping = trial_poles, trial, max(damping / 10, 1e-12)
            if np.abs((change + 1j * turn) / poles.real).max() < ENOUGH:
                break
        else:
            damping *= 10
            if damping > 1e6:
                break
    return fit.result(frequency, responses, deviation is not None)


class _project:  # noqa: N801  # a step of the search, not a thing of the field
    """Residues at given poles, and the normal equations of a step of the poles."""

    def __init__(self, frequency: Frequencies, values: Matrix, weight: Matrix, poles: Poles, power: int) -> None:
        self.poles, self.power, self.weight = poles, power, weight
        m, f = len(poles), len(frequency)
        basis = columns(frequency, poles, power)
        s = 2j * np.pi * frequency[:, None]
        first, second = s**power / (s - poles) ** 2, s**power / (s - poles.conj()) ** 2
        self.normal, self.right, self.square = np.zeros((2 * m, 2 * m)), np.zeros(2 * m), 0.0
        self.amplitudes, self.inverses = [], []
        noise = []
        even = bool(np.ptp(weight, axis=1).max() == 0)
        shared = np.linalg.qr(basis) if even else None
        for value, w in zip(values, weight, strict=True):
            # Equal weights along a response leave the directions of its columns as they are.
            q, r = np.linalg.qr(basis * w[:, None]) if shared is None else (shared[0], shared[1] * w[0])
            amplitude = np.linalg.lstsq(r, q.T @ (value * w), rcond=None)[0]
            left = value * w - (basis @ amplitude) * w
            residue = amplitude[:m] + 1j * amplitude[m : 2 * m]
            by_real = residue * first + residue.conj() * second
            by_imag = 1j * (residue * first - residue.conj() * second)
            slope = np.hstack([by_real, by_imag])
            slope = np.vstack([slope.real, slope.imag]) * w[:, None]
            slope -= q @ (q.T @ slope)
            self.normal += slope.T @ slope
            self.right += slope.T @ left
            self.square += float(left @ left)
            self.amplitudes.append(amplitude)
            self.inverses.append(np.linalg.pinv(r))
            noise.append(np.sqrt(((left / w) ** 2).sum() / max(2 * f - basis.shape[1], 1)))
        self.noise = np.array(noise)

    def result(self, frequency: Frequencies, responses: Responses, known: bool) -> ModalFit:
        """The fit with its covariance."""
        m, f = len(self.poles), len(frequency)
        basis = columns(frequency, self.poles, self.power)
        fitted = np.array([basis @ amplitude for amplitude in self.amplitudes])
        scale = 1.0
        if known:  # deviations that are too small for what is left are scaled up
            scale = max(self.square / max(2 * f * len(responses) - basis.shape[1] * len(responses), 1), 1.0)
        covariance = np.asarray(np.linalg.pinv(self.normal, hermitian=True) * scale, dtype=np.float64)
        spread = np.array([np.sqrt(scale * (inverse**2).sum(axis=1)) for inverse in self.inverses])
        residues = np.array([amplitude[:m] + 1j * amplitude[m : 2 * m] for amplitude in self.amplitudes])
        return ModalFit(
            poles=self.poles,
            pole_covariance=covariance,
            residues=residues,
            residue_deviation=np.sqrt((spread[:, :m] ** 2 + spread[:, m : 2 * m] ** 2) / 2),
            fitted=fitted[:, :f] + 1j * fitted[:, f:],
            noise=self.noise,
        )
