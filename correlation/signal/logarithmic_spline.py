r"""Modes of a ring-down whose logarithms are splines of time, by least squares.

.. math:: x(t) = \operatorname{Re} \sum_m e^{L_m(t)} + \sum_k \operatorname{Re}\, c_{mk}(t)\, A_m(t)\,
          e^{i k \varphi_m(t)} + c_0(t), \qquad L_m = \ln A_m + i \varphi_m

A linear mode is a straight line L, exactly; nonlinear ones bend it slowly. Harmonics and a drifting mean have
polynomial factors c. Because the model is fitted from the first sample used to the last, there is no filter, and so no
edge at which it rings; modes that overlap in the spectrum are separated as far as their difference exceeds the noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.optimize import least_squares

Vector = Float[NDArray[np.float64], " n"]
Matrix = Float[NDArray[np.float64], "n p"]
Envelope = Complex[NDArray[np.complex128], " n"]

#: Degree of the splines, and of the polynomials of harmonics and mean.
DEGREE, SLOW_DEGREE = 3, 3
#: Evaluations of the model, and the relative fall of the residual that ends the search.
MOST_EVALUATIONS, ENOUGH = 40, 1e-8


@dataclass(frozen=True, kw_only=True, eq=False)
class ModeStart:
    """Where the fit of a mode begins.

    Parameters
    ----------
    logarithm
        First guess of L at every sample of the fit, shape (n,).
    n_sample
        Samples before the mode has sunk into the noise; beyond, it is left out [-].
    breaks
        Rising break points of its splines in [0, 1], as shares of those samples.
    harmonics
        Orders of its harmonics, 2 and above.
    """

    logarithm: Envelope
    n_sample: int
    breaks: Vector
    harmonics: tuple[int, ...]

    def knots(self) -> Vector:
        """Knots of its splines."""
        return np.concatenate([[self.breaks[0]] * DEGREE, self.breaks, [self.breaks[-1]] * DEGREE])


@dataclass(frozen=True, kw_only=True, eq=False)
class LogarithmicFit:
    """Fitted modes.

    Parameters
    ----------
    splines
        Of each mode, ln A and phi as one spline with two columns over its share of samples in [0, 1].
    covariance
        Of the coefficients of each mode, ln A first, shape (2 b, 2 b).
    residual
        What they leave, shape (n,).
    n_parameter
        Number of coefficients in total [-].
    """

    splines: tuple[BSpline, ...]
    covariance: tuple[Matrix, ...]
    residual: Vector
    n_parameter: int

    @property
    def criterion(self) -> float:
        """Bayes's information criterion: the smaller the better."""
        n = len(self.residual)
        return float(n * np.log((self.residual**2).mean()) + self.n_parameter * np.log(n))


class _Model:
    """Residual and its derivatives by the coefficients: of ln A and phi of each mode, then of the linear part."""

    def __init__(self, values: Vector, modes: Sequence[ModeStart]) -> None:
        self.values, self.modes = values, modes
        self.bases = [
            BSpline.design_matrix(np.linspace(0, 1, mode.n_sample), mode.knots(), DEGREE).toarray() for mode in modes
        ]
        self.slow = np.polynomial.legendre.legvander(np.linspace(-1, 1, len(values)), SLOW_DEGREE)
        self.first = np.cumsum([0] + [2 * basis.shape[1] for basis in self.bases])
        self.scale = float(values.std())

    def start(self) -> Vector:
        """Coefficients of the first guesses: each spline by least squares, weighted by the amplitude."""
        parts = []
        for basis, mode in zip(self.bases, self.modes, strict=True):
            logarithm = mode.logarithm[: mode.n_sample]
            weight = np.exp(logarithm.real - logarithm.real.max()) + 1e-3
            parts += [np.linalg.lstsq(basis * weight[:, None], part * weight, rcond=None)[0]
                      for part in (logarithm.real, logarithm.imag)]  # fmt: skip
        nonlinear = np.concatenate(parts)
        waves, columns = self._waves(nonlinear), self._linear(nonlinear)
        left = self.values - sum(wave.real for wave in waves)
        return np.concatenate([nonlinear, np.linalg.lstsq(columns, left, rcond=None)[0]])

    def _waves(self, coefficients: Vector) -> list[Envelope]:
        """e^{L_m}, each zero beyond its own end."""
        waves = []
        for basis, mode, first in zip(self.bases, self.modes, self.first, strict=False):
            b = basis.shape[1]
            wave = np.zeros(len(self.values), dtype=np.complex128)
            logarithm = basis @ (coefficients[first : first + b] + 1j * coefficients[first + b : first + 2 * b])
            wave[: mode.n_sample] = np.exp(np.minimum(logarithm.real, 50) + 1j * logarithm.imag)
            waves.append(wave)
        return waves

    def _linear(self, coefficients: Vector) -> Matrix:
        """Columns of mean and harmonics, of the size of the signal."""
        columns = [self.slow * self.scale]
        for wave, mode in zip(self._waves(coefficients), self.modes, strict=True):
            size = np.abs(wave)
            unit = wave / np.where(size > 0, size, 1)
            for order in mode.harmonics:
                turning = size * unit**order
                columns += [self.slow * turning.real[:, None], self.slow * turning.imag[:, None]]
        return np.hstack(columns)

    def residual(self, coefficients: Vector) -> Vector:
        """Model minus values, shape (n,)."""
        first = self.first[-1]
        total = self._linear(coefficients) @ coefficients[first:] - self.values
        for wave in self._waves(coefficients):
            total = total + wave.real
        return np.asarray(total)

    def jacobian(self, coefficients: Vector) -> Matrix:
        """Derivatives, without those of the harmonics by the phase of their mode: they are small beside its own."""
        columns = []
        for wave, basis in zip(self._waves(coefficients), self.bases, strict=True):
            whole = np.zeros((len(self.values), basis.shape[1]))
            whole[: len(basis)] = basis
            columns += [whole * wave.real[:, None], -whole * wave.imag[:, None]]
        return np.hstack([*columns, self._linear(coefficients)])


def fit_logarithms(values: Vector, modes: Sequence[ModeStart]) -> LogarithmicFit:
    """Fit all modes at once.

    Parameters
    ----------
    values
        Evenly spaced samples from the start of the fit, shape (n,) [any unit].
    modes
        First guesses.
    """
    model = _Model(values, modes)
    found = least_squares(
        model.residual, model.start(), model.jacobian, method="trf", x_scale="jac", ftol=ENOUGH, xtol=1e-12, gtol=1e-15,
        max_nfev=MOST_EVALUATIONS,
    )  # fmt: skip
    variance = 2 * found.cost / max(len(values) - len(found.x), 1)
    slopes: Matrix = np.asarray(found.jac)
    norm = np.linalg.norm(slopes, axis=0)
    norm[norm == 0] = 1
    slopes = slopes / norm
    covariance = np.linalg.pinv(slopes.T @ slopes, rcond=1e-12) * variance / np.outer(norm, norm)
    splines, parts = [], []
    for mode, first, last in zip(modes, model.first, model.first[1:], strict=False):
        coefficients = found.x[first:last].reshape(2, -1).T
        splines.append(BSpline(mode.knots(), coefficients, DEGREE))
        parts.append(covariance[first:last, first:last])
    return LogarithmicFit(
        splines=tuple(splines), covariance=tuple(parts), residual=np.asarray(found.fun), n_parameter=len(found.x)
    )
