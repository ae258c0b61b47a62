r"""Slow flow of the modes of a ring-down: decay rate and frequency of each are functions of its amplitude alone.

.. math:: \dot a = -\delta(a), \quad \dot\varphi = \omega(a), \qquad
          x(t) = \operatorname{Re} \sum_m \Big( A_m e^{i \varphi_m} + \sum_k c_{mk}(A_m)\, A_m\, e^{i k \varphi_m} \Big)
          + c_0

with a = ln A, and ln delta and omega as splines of a. For a linear mode these are constants; with friction or nonlinear
springs they vary. The factors c of the harmonics are polynomials of the amplitude. The model is fitted in the time
domain from the first to the last used sample, so that there are no edge effects of a filter; modes that overlap in the
spectrum are separated if their difference exceeds the noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

Vector = Float[NDArray[np.float64], " n"]
Matrix = Float[NDArray[np.float64], "n p"]
Envelope = Complex[NDArray[np.complex128], " n"]

#: Degree of the harmonics as polynomials of the amplitude, and of a drifting mean over time.
AMPLITUDE_DEGREE, MEAN_DEGREE = 3, 2
#: Number of points of a flow between its largest and smallest amplitude.
FLOW_POINTS = 1000
#: Extension of a flow below its last break point, at constant rates, in ln A: to 1/400 of that amplitude [-].
EXTENSION = 6.0
#: Largest number of Levenberg-Marquardt steps, and relative decrease of the residual that ends them: in general, and in
#: a fit with priors, which only tracks the phases.
ROUNDS, ENOUGH, ENOUGH_TRACKED = 25, 1e-4, 1e-2
#: Relative singular value of scaled normal equations that counts as zero; and ratio of the normal equations of a
#: coefficient to the variance of the residual below which it is unobservable: their quotient must not overflow [-].
SINGULAR, MIN_OBSERVABLE = 1e-12, 1e-280


@dataclass(frozen=True, kw_only=True, eq=False)
class SlowFlow:
    """Slow flow of amplitude and phase of one mode.

    Parameters
    ----------
    breaks
        Break points of the splines in a = ln A, ascending.
    degree
        Degree of the splines: 0 for a linear mode.
    coefficients
        a and phi at the start, then those of ln delta, then those of omega, shape (2 + 2 b,).
    n_sample
        Number of samples; below the noise the flow continues at constant rates.
    harmonics
        Orders of the harmonics, 2 and above.
    """

    breaks: Vector
    degree: int
    coefficients: Vector
    n_sample: int
    harmonics: tuple[int, ...]

    def basis(self, logarithm: Vector, derivative: int = 0) -> Matrix:
        """Values or derivatives of the basis functions at some a, shape (n, b); constant beyond the breaks."""
        from scipy.interpolate import BSpline

        if self.degree == 0:
            return np.ones((len(logarithm), 1)) if derivative == 0 else np.zeros((len(logarithm), 1))
        knots = np.concatenate([[self.breaks[0]] * self.degree, self.breaks, [self.breaks[-1]] * self.degree])
        inside = np.clip(logarithm, self.breaks[0], self.breaks[-1])
        count = len(knots) - self.degree - 1
        return np.asarray(BSpline(knots, np.eye(count), self.degree)(inside, nu=derivative))

    def path(self, coefficients: Vector) -> tuple[Vector, Vector, Vector]:
        """Time since the start [s], a, and phi along the flow, shape (p,) each."""
        return self._path(coefficients)[:3]

    def _path(self, coefficients: Vector) -> tuple[Vector, Vector, Vector, Matrix, Vector, Vector]:
        """The same with the basis functions, shape (p, b), decay rate and frequency there, shape (p,) [1/s, rad/s]."""
        count = (len(coefficients) - 2) // 2
        lowest = min(self.breaks[0], coefficients[0]) - EXTENSION
        logarithm = np.linspace(coefficients[0], lowest, FLOW_POINTS)
        basis = self.basis(logarithm)
        rate = np.exp(np.clip(basis @ coefficients[2 : 2 + count], -50, 50))
        omega = basis @ coefficients[2 + count :]
        step = (logarithm[0] - logarithm[1]) / 2
        time = np.concatenate([[0.0], np.cumsum(step * (1 / rate[1:] + 1 / rate[:-1]))])
        turned = np.concatenate([[0.0], np.cumsum(step * (omega[1:] / rate[1:] + omega[:-1] / rate[:-1]))])
        return time, logarithm, coefficients[1] + turned, basis, rate, omega

    def linearise(self, coefficients: Vector, step: float) -> tuple[Envelope, Matrix]:
        r"""A e^{i phi} at its samples, shape (n_sample,), and derivatives of its real part, shape (n_sample, 2 + 2 b).

        Where a coefficient changes the time at which the flow passes a by dt and the phase there by dphi, the wave at a
        fixed time changes by :math:`A e^{i \varphi} (-\dot a\, dt + i (d\varphi - \dot\varphi\, dt))`. A start at a
        larger amplitude passes all others later, by dt = 1 / delta and dphi = omega / delta there.
        """
        count = (len(coefficients) - 2) // 2
        time, logarithm, phase, basis, rate, omega = self._path(coefficients)
        at = step * np.arange(self.n_sample)
        # Each sample lies between two points of the flow; beyond the last, far below the noise, it rests there.
        below = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
        # A decay rate without bounds may pass several points at once.
        width, moves = np.maximum(time[below + 1] - time[below], 1e-300), at < time[-1]
        share = np.where(moves, np.clip((at - time[below]) / width, 0.0, 1.0), 1.0)
        fall, turn = np.diff(logarithm)[below], np.diff(phase)[below]
        wave = np.exp(logarithm[below] + share * fall + 1j * (phase[below] + share * turn))
        fall, turn = np.where(moves, fall / width, 0.0), np.where(moves, turn / width, 0.0)
        by_time, by_phase = wave.imag * turn - wave.real * fall, -wave.imag
        # d (1 / delta) = -B / delta by the coefficients of ln delta; d (omega / delta) = -omega B / delta by those, and
        # B / delta by the coefficients of omega.
        growth = (logarithm[0] - logarithm[1]) / 2 * basis / rate[:, None]
        sums = np.zeros((len(time), 2 * count))
        for part, rates in ((sums[1:, :count], growth), (sums[1:, count:], omega[:, None] * growth)):
            np.cumsum(rates[1:] + rates[:-1], axis=0, out=part)
        sums = sums[below] + share[:, None] * (sums[below + 1] - sums[below])
        result = np.empty((self.n_sample, len(coefficients)))
        result[:, 0] = (by_time + omega[0] * by_phase) / rate[0]
        result[:, 1] = by_phase
        result[:, 2 : 2 + count] = -sums[:, :count] * by_time[:, None] - sums[:, count:] * by_phase[:, None]
        result[:, 2 + count :] = sums[:, :count] * by_phase[:, None]
        return wave, result


@dataclass(frozen=True, kw_only=True, eq=False)
class SlowFlowFit:
    """Fitted modes.

    Parameters
    ----------
    flows
        The modes with their coefficients.
    covariance
        Covariance of the coefficients of each mode, shape (2 + 2 b, 2 + 2 b).
    residual
        Values minus model, shape (n,).
    n_parameter
        Number of coefficients in total [-].
    """

    flows: tuple[SlowFlow, ...]
    covariance: tuple[Matrix, ...]
    residual: Vector
    n_parameter: int

    @property
    def criterion(self) -> float:
        """Bayesian information criterion; smaller is better."""
        n = len(self.residual)
        return float(n * np.log((self.residual**2).mean() + 1e-300) + self.n_parameter * np.log(n))


def fit_slow_flows(values: Vector, step: float, flows: Sequence[SlowFlow], prior: float = np.inf) -> SlowFlowFit:
    """Fit all modes simultaneously by the Levenberg-Marquardt method; the linear part is solved for in every step.

    Parameters
    ----------
    values
        Evenly spaced samples from the start of the fit, shape (n,) [any unit].
    step
        Time between them [s].
    flows
        Initial guesses.
    prior
        Relative standard deviation of the initial guesses of decay rates and frequencies [-]; values that the samples
        do not determine stay near them.
    """
    at = [np.array(flow.coefficients) for flow in flows]
    places = np.cumsum([0] + [len(part) for part in at])
    residual, normal, right = _linearise(values, step, flows, at)
    square, damping = float(residual @ residual), 1e-3
    limit = np.concatenate([_compute_largest_step(flow, step) for flow in flows])
    first = np.concatenate(at)
    certainty = np.concatenate([_compute_certainty(flow, prior) for flow in flows])
    enough = ENOUGH if np.isinf(prior) else ENOUGH_TRACKED
    for _ in range(ROUNDS):
        pull = np.zeros(len(normal))
        pull[: places[-1]] = certainty * square / len(values)
        away = np.zeros(len(normal))
        away[: places[-1]] = first - np.concatenate(at)
        change = _solve(normal + damping * np.diag(np.diag(normal)) + np.diag(pull), right + pull * away)[: places[-1]]
        change *= min(1.0, float((limit / np.maximum(np.abs(change), 1e-300)).min()))
        trial_at = [part + change[a:b] for part, (a, b) in zip(at, pairwise(places), strict=True)]
        trial = _linearise(values, step, flows, trial_at)
        now = float(trial[0] @ trial[0])
        if np.isfinite(now) and now < square:
            fallen, square, at = square - now, now, trial_at
            residual, normal, right = trial
            damping = max(damping / 10, 1e-9)
            if fallen < enough * now:
                break
        else:
            damping *= 10
            if damping > 1e5:
                break
    variance = square / max(len(values) - len(normal), 1)
    # Coefficients that the samples do not determine get a large but finite variance, whatever the unit of the values.
    scale = np.sqrt(np.maximum(np.diag(normal), max(1e-300, MIN_OBSERVABLE * variance)))
    covariance = np.linalg.pinv(normal / np.outer(scale, scale), rcond=SINGULAR, hermitian=True) * variance
    covariance = covariance / np.outer(scale, scale)
    return SlowFlowFit(
        flows=tuple(replace(flow, coefficients=part) for flow, part in zip(flows, at, strict=True)),
        covariance=tuple(covariance[a:b, a:b] for a, b in pairwise(places)),
        residual=residual,
        n_parameter=len(normal),
    )  # fmt: skip


def _compute_certainty(flow: SlowFlow, prior: float) -> Vector:
    """Inverse variance of the initial guess of each coefficient."""
    count = (len(flow.coefficients) - 2) // 2
    typical = float(np.median(flow.coefficients[2 + count :]))
    return np.concatenate([[0.0, 0.0], np.full(count, (20 * prior) ** -2.0), np.full(count, (prior * typical) ** -2.0)])


def _compute_largest_step(flow: SlowFlow, step: float) -> Vector:
    """Largest step of each coefficient: a logarithm by 0.5, a phase by 1 rad, also at the end."""
    count = (len(flow.coefficients) - 2) // 2
    return np.concatenate([[0.5, 1.0], np.full(count, 0.5), np.full(count, 4.0 / (step * flow.n_sample))])


def _linearise(
    values: Vector, step: float, flows: Sequence[SlowFlow], at: Sequence[Vector]
) -> tuple[Vector, Matrix, Vector]:
    """Residual with the best linear part, and the normal equations of a step of all coefficients.

    Derivatives of the harmonics with respect to the coefficients of their mode are neglected.
    """
    n = len(values)
    mean = np.polynomial.legendre.legvander(np.linspace(-1, 1, n), MEAN_DEGREE) * np.abs(values).max()
    own, linear, left = [], [mean], values.copy()
    for flow, coefficients in zip(flows, at, strict=True):
        wave, own_slopes = flow.linearise(coefficients, step)
        left[: flow.n_sample] -= wave.real
        slopes = np.zeros((n, len(coefficients)))
        slopes[: flow.n_sample] = own_slopes
        own.append(slopes)
        amplitude = np.maximum(np.abs(wave), 1e-300)
        powers = (amplitude / amplitude.max())[:, None] ** np.arange(AMPLITUDE_DEGREE + 1) * amplitude[:, None]
        for order in flow.harmonics:
            turning = (wave / amplitude) ** order
            whole = np.zeros((n, 2 * powers.shape[1]))
            whole[: flow.n_sample] = np.hstack([powers * turning.real[:, None], powers * turning.imag[:, None]])
            linear.append(whole)
    side = np.hstack(linear)
    residual = left - side @ _solve(side.T @ side, side.T @ left)
    columns = np.hstack([*own, side])
    return residual, columns.T @ columns, columns.T @ residual


def _solve(normal: Matrix, right: Vector) -> Vector:
    """Solution of scaled normal equations of any rank."""
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    return np.asarray(np.linalg.lstsq(normal / np.outer(scale, scale), right / scale, rcond=1e-13)[0] / scale)
