r"""Poles and residues of frequency responses by weighted least squares, with their covariance.

The receptance between one force and the sensors c is

.. math:: H_c(\omega) = \sum_m \left( \frac{R_{cm}}{i \omega - p_m} + \frac{\bar R_{cm}}{i \omega - \bar p_m} \right)
          + \frac{L_c}{\omega^2} + U_c

with residual terms of the modes below and above the band; mobility and accelerance are the receptance times
:math:`i \omega` and :math:`-\omega^2`. Residues and residual terms are linear and are solved for at every step, so that
the Gauss-Newton iteration changes the poles alone (variable projection).

The noise of a sensor has a constant part and a part proportional to the response, :math:`v = a^2 |H|^2 + b^2`; both are
estimated from the residual. H is the response in the measured quantity: constant noise of an accelerometer grows as
:math:`1 / \omega^2` towards low frequencies in the receptance.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.modal.window import compute_pole_response
from correlation.noise.variance import fit_two_shares

Poles = Complex[NDArray[np.complex128], " m"]
Responses = Complex[NDArray[np.complex128], "c f"]
Frequencies = Float[NDArray[np.float64], " f"]
Matrix = Float[NDArray[np.float64], "n p"]
Noise = Float[NDArray[np.float64], "c f"]
Powers = Int[NDArray[np.int64], " c"]

#: Largest number of steps, and final step of a pole as a share of its distance from the imaginary axis.
ROUNDS, ENOUGH = 40, 1e-7
#: A residual below this share of a response does not justify another mode: no measurement is as linear [-].
NEGLIGIBLE = 1e-4
#: Number of real residual terms per sensor, two each for L and U.
RESIDUAL_TERMS = 4
#: Least ratio of proportional to constant noise variance at the largest response for the proportional part to be used:
#: the few lines of a resonance determine it to some tens of per cent [-].
GROWS = 1.0
#: Number of lines that count as one under a Hann window: sum of the squared correlations 1, 2/3 and 1/6 [-].
LINES_ALIKE = 1 + 2 * (4 / 9 + 1 / 36)
#: Iterations of the two parts, and least variance over the largest, so that no line at an antiresonance dominates [-].
NOISE_ROUNDS, LEAST_VARIANCE = 6, 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class ModalFit:
    """Poles and residues.

    Parameters
    ----------
    poles
        Poles, shape (m,) [rad/s].
    pole_covariance
        Covariance of real and imaginary parts, all real parts first, shape (2 m, 2 m) [rad^2/s^2].
    residues, residue_deviation
        R, shape (c, m), and standard deviation of its real and of its imaginary part.
    fitted
        Responses of the model, shape (c, f).
    noise
        Standard deviation of real and imaginary part of the residual, shape (c, f).
    """

    poles: Poles
    pole_covariance: Matrix
    residues: Complex[NDArray[np.complex128], "c m"]
    residue_deviation: Float[NDArray[np.float64], "c m"]
    fitted: Responses
    noise: Noise

    def criterion(self) -> float:
        """Bayesian information criterion; smaller is better."""
        c, f = self.fitted.shape
        count = 2 * len(self.poles) * (1 + c) + RESIDUAL_TERMS * c
        least = NEGLIGIBLE * np.sqrt((np.abs(self.fitted) ** 2).mean(axis=1, keepdims=True)) + 1e-300
        return float(4 * np.log(np.maximum(self.noise, least)).sum() + count * np.log(2 * f * c))


class _Basis:
    """Real basis of responses with given poles, independent of weights.

    Parameters
    ----------
    frequency, poles, duration
        As in `fit_poles`.
    powers
        Powers that occur.
    """

    def __init__(self, frequency: Frequencies, poles: Poles, powers: set[int], duration: float | None) -> None:
        self.poles, self.duration = poles, duration
        self.columns: dict[int, Matrix] = {}
        self.slopes: dict[int, tuple[Responses, Responses]] = {}
        self._directions: dict[int, tuple[Matrix, Matrix]] = {}
        s = 2j * np.pi * frequency[:, None]
        size = np.abs(poles.imag).mean() if len(poles) else 2 * np.pi * frequency.mean()
        for power in powers:
            first, by_first = compute_pole_response(s, poles, power, duration)
            second, by_second = compute_pole_response(s, poles.conj(), power, duration)
            background = np.hstack([(size / np.abs(s)) ** 2, np.ones_like(s)]) / size * s**power
            basis = np.hstack([first + second, 1j * (first - second), background, 1j * background])
            self.columns[power] = np.vstack([basis.real, basis.imag])
            self.slopes[power] = by_first, by_second

    def directions(self, power: int) -> tuple[Matrix, Matrix]:
        """QR factors of the columns."""
        if power not in self._directions:
            self._directions[power] = np.linalg.qr(self.columns[power])
        return self._directions[power]


def fit_poles(
    frequency: Frequencies,
    responses: Responses,
    poles: Poles,
    power: Powers,
    deviation: Responses | None = None,
    duration: float | None = None,
) -> ModalFit:
    """Poles and residues from initial guesses of the poles.

    Parameters
    ----------
    frequency
        Frequencies, shape (f,) [Hz].
    responses
        Responses, shape (c, f).
    poles
        Initial guesses, shape (m,) [rad/s].
    power
        Power of i omega in each response relative to a receptance: 0, 1 or 2, shape (c,).
    deviation
        Standard deviation of real and imaginary part, shape (c, f); equal along each response by default.
    duration
        Duration of the Hann window under which the responses were estimated [s]; None for no leakage.
    """
    values = np.hstack([responses.real, responses.imag])
    if deviation is None:
        weight = np.ones_like(values) / np.sqrt((values**2).mean(axis=1, keepdims=True))
    else:
        weight = np.hstack([1 / deviation, 1 / deviation]).real
    damping = 1e-3
    powers = set(power.tolist())
    fit = _Projection(values, weight, _Basis(frequency, poles, powers, duration), power)
    for _ in range(ROUNDS):
        if deviation is None:
            # Noise differs between sensors: each is weighted by its residual.
            noise = np.maximum(fit.estimate_noise(), 1e-12 * np.abs(values).max())
            weight = np.hstack([1 / noise, 1 / noise])
            fit = _Projection(values, weight, fit.basis, power)
        normal, right = fit.normal_equations()
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-300), right)
        m = len(poles)
        change = np.clip(step[:m] / -poles.real, -0.5, 0.5) * -poles.real
        turn = np.clip(step[m:] / -poles.real, -2, 2) * -poles.real
        trial_poles = poles + change + 1j * turn
        trial = _Projection(values, weight, _Basis(frequency, trial_poles, powers, duration), power)
        if trial.square < fit.square:
            poles, fit, damping = trial_poles, trial, max(damping / 10, 1e-12)
            if np.abs((change + 1j * turn) / poles.real).max() < ENOUGH:
                break
        else:
            damping *= 10
            if damping > 1e6:
                break
    return fit.result(deviation is not None)


class _Projection:
    """Residues at given poles, and the residual."""

    def __init__(self, values: Matrix, weight: Matrix, basis: _Basis, power: Powers) -> None:
        self.basis, self.weight, self.power = basis, weight, power.tolist()
        m, f = len(basis.poles), values.shape[1] // 2
        self.square = 0.0
        self.amplitudes, self.directions, self.triangles = [], [], []
        self.fitted, self.left = np.empty_like(values), np.empty_like(values)
        self.freedom = max(2 * (f - m) - RESIDUAL_TERMS, 1)
        even = np.ptp(weight, axis=1) == 0
        for row, (value, w) in enumerate(zip(values, weight, strict=True)):
            columns = basis.columns[self.power[row]]
            if even[row]:  # equal weights along a response do not change the orthonormal basis
                q, r = basis.directions(self.power[row])
                r = r * w[0]
            else:
                q, r = np.linalg.qr(columns * w[:, None])
            amplitude = np.linalg.lstsq(r, q.T @ (value * w), rcond=None)[0]
            self.fitted[row] = columns @ amplitude
            self.left[row] = value - self.fitted[row]
            left = self.left[row] * w
            self.square += float(left @ left)
            self.amplitudes.append(amplitude)
            self.directions.append(q)
            self.triangles.append(r)

    def normal_equations(self) -> tuple[Matrix, Float[NDArray[np.float64], " p"]]:
        """Normal equations of a step of the poles, real parts first: matrix, (2 m, 2 m), and right side, (2 m,)."""
        m = len(self.basis.poles)
        normal, right = np.zeros((2 * m, 2 * m)), np.zeros(2 * m)
        for row, (amplitude, q, w) in enumerate(zip(self.amplitudes, self.directions, self.weight, strict=True)):
            first, second = self.basis.slopes[self.power[row]]
            residue = amplitude[:m] + 1j * amplitude[m : 2 * m]
            by_real = residue * first + residue.conj() * second
            by_imag = 1j * (residue * first - residue.conj() * second)
            slope = np.hstack([by_real, by_imag])
            slope = np.vstack([slope.real, slope.imag]) * w[:, None]
            slope -= q @ (q.T @ slope)
            normal += slope.T @ slope
            right += slope.T @ (self.left[row] * w)
        return normal, right

    def estimate_noise(self) -> Noise:
        """Standard deviation of real and imaginary part at each line, from the residual, shape (c, f)."""
        response, scatter = (part[:, : part.shape[1] // 2] ** 2 + part[:, part.shape[1] // 2 :] ** 2
                             for part in (self.fitted, self.left))  # fmt: skip
        return np.array([_fit_noise(*pair, self.freedom) for pair in zip(response, scatter, strict=True)])

    def scale_noise(self) -> Noise:
        """The stated deviations, scaled to the residual of each sensor, shape (c, f)."""
        size = np.sqrt(((self.left * self.weight) ** 2).sum(axis=1, keepdims=True) / self.freedom)
        return np.asarray(size / self.weight[:, : self.weight.shape[1] // 2])

    def result(self, known: bool) -> ModalFit:
        """The fit with its covariance."""
        m, f = len(self.basis.poles), self.left.shape[1] // 2
        # Correlated noise of sensors or lines averages less.
        scale = 1.0 if self.basis.duration is None else LINES_ALIKE
        scale *= _count_sensors_alike((self.left * self.weight)[:, :f] + 1j * (self.left * self.weight)[:, f:])
        if known:  # deviations that are too small for the residual are scaled up
            scale *= max(self.square / (self.freedom * len(self.left)), 1.0)
        normal, _ = self.normal_equations()
        covariance = np.asarray(np.linalg.pinv(normal, hermitian=True) * scale, dtype=np.float64)
        spread = np.array([np.sqrt(scale * (np.linalg.pinv(r) ** 2).sum(axis=1)) for r in self.triangles])
        residues = np.array([amplitude[:m] + 1j * amplitude[m : 2 * m] for amplitude in self.amplitudes])
        return ModalFit(
            poles=self.basis.poles,
            pole_covariance=covariance,
            residues=residues,
            residue_deviation=np.sqrt((spread[:, :m] ** 2 + spread[:, m : 2 * m] ** 2) / 2),
            fitted=self.fitted[:, :f] + 1j * self.fitted[:, f:],
            noise=self.scale_noise() if known else self.estimate_noise(),
        )


def _count_sensors_alike(left: Responses) -> float:
    """Number of sensors that count as one because their residuals are correlated [-].

    It is the mean over the sensors of the sum of their squared correlations.
    """
    size = np.sqrt((np.abs(left) ** 2).sum(axis=1))
    if not (size > 0).all():
        return 1.0
    unit = left / size[:, None]
    squared = np.abs(unit @ unit.conj().T) ** 2
    # Correlation of independent residuals by chance.
    by_chance = (len(left) - 1) / left.shape[1]
    return float(max(squared.sum() / len(left) - by_chance, 1.0))


def _fit_noise(response: Frequencies, scatter: Frequencies, freedom: int) -> Frequencies:
    r"""Standard deviation of real and imaginary part at each line of one sensor, from :math:`v = a^2 |H|^2 + b^2`.

    Fisher scoring of the likelihood. The parts are scaled so that squared residuals over v sum to their degrees of
    freedom.

    Parameters
    ----------
    response, scatter
        Squared moduli of the fitted response and of the residual, shape (f,).
    freedom
        Degrees of freedom: number of data less that of fitted parameters.
    """
    even = np.full_like(scatter, max(float(scatter.sum()) / freedom, np.finfo(np.float64).tiny))
    top = float(response.max())
    if not top > 0:
        return np.sqrt(even)
    parts, variance, share = np.stack([response / top, np.ones_like(response)]), even, np.zeros(2)
    for _ in range(NOISE_ROUNDS):
        share = fit_two_shares(parts, scatter / 2, (even / variance) ** 2)
        variance = np.maximum(share @ parts, LEAST_VARIANCE * share.sum())
    if share[0] < GROWS * share[1]:
        return np.sqrt(even)
    return np.asarray(np.sqrt(variance * (scatter / variance).sum() / freedom))
