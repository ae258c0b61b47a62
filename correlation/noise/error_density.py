"""Most probable sizes of the errors of a model.

The parts of curves do not overlap, so that the covariance of readings has a closed-form inverse; the modes of noise are
added by Woodbury's identity. -2 ln p of many sizes then follows cheaply from inner products of the few columns of F, D
and H and the difference. These products depend on the size of the errors of readings alone, and, except for the
difference, on nothing that a fit changes. Sizes are searched on one grid; its products are computed once.
"""

from collections import OrderedDict
from dataclasses import astuple
from itertools import product
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import scipy.linalg
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.noise.covariance import Whitening
from correlation.noise.error_patterns import ErrorPatterns
from correlation.noise.error_size import NO_ERROR, ErrorSize

Vector = Float[NDArray[np.float64], " m"]
Matrix = NDArray[np.float64]
#: Sizes of the errors of frequencies, damping and shapes [-].
Sizes = Float[NDArray[np.float64], " 3"]

#: Least fall of -2 ln p by all sizes together for which an error is assumed. If the true value of all four sizes is
#: zero, chance exceeds it in 15 % (half a chi-square of one degree of freedom each), with their priors less often.
MIN_GAIN = 4.0
#: Share of the usual size below which a size counts as zero, and least share that is tried [-].
SMALL_SIZE, MIN_SIZE = 0.05, 0.01
#: Start values of sizes over the usual ones [-].
FIRST_SIZES = (MIN_SIZE, 1.0, 10.0, 100.0)
#: Largest size over the usual one, limited by round-off [-].
MAX_SIZE = 1e4
#: First and last size of errors of readings in the coarse search, besides zero, in half decades above the usual one.
FIRST_READING, LAST_READING = -2.0, 6.0
#: First and last step of the search for this size, in half decades; the last one is 4 %.
COARSE_STEP, FINE_STEP = 2.0, 2.0**-5
#: Number of sizes of the errors of readings whose inner products are retained. All sizes are on one grid, so that fits
#: with similar starts use the same ones.
RETAINED = 32


def estimate_error_size(
    whitening: Whitening, patterns: ErrorPatterns, usual: ErrorSize, difference: Vector
) -> ErrorSize:
    """Most probable sizes of the errors of a model; `NO_ERROR` if they explain no more than chance.

    Parameters
    ----------
    whitening
        S.
    patterns
        F, D, G and H.
    usual
        Scales of the priors; a scale of zero excludes errors of this kind.
    difference
        Measured less predicted features, shape (m,).
    """
    density = ErrorSizeDensity(whitening, patterns, usual, difference)
    reading, others, least = _search_readings(density, usual.reading)
    if least > density(NO_ERROR) - MIN_GAIN:
        return NO_ERROR
    frequency, damping, shape = others.tolist()
    sizes = np.array([frequency, damping, reading, shape])
    return ErrorSize(*np.where(sizes < SMALL_SIZE * np.array(astuple(usual)), 0.0, sizes).tolist())


def _search_readings(density: "ErrorSizeDensity", usual: float) -> tuple[float, Sizes, float]:
    """Size of the errors of readings, corresponding sizes of the other errors, and -2 ln p."""
    tried: dict[float, tuple[Sizes, float]] = {0.0: density.minimise(0.0)}
    if not usual:
        return 0.0, *tried[0.0]

    def cost(half_decades: float) -> float:
        reading = usual * 10 ** (0.5 * half_decades)
        if reading not in tried:
            near = min(tried, key=lambda known: abs(np.log((known + MIN_SIZE * usual) / (reading + MIN_SIZE * usual))))
            tried[reading] = density.minimise(reading, tried[near][0])
        return tried[reading][1]

    coarse = np.arange(FIRST_READING, LAST_READING + COARSE_STEP / 2, COARSE_STEP).tolist()
    best, step = min(coarse, key=cost), COARSE_STEP
    while step > FINE_STEP and cost(best) <= tried[0.0][1]:
        step /= 2
        best = min((best - step, best, min(best + step, LAST_READING)), key=cost)
    reading = min(tried, key=lambda item: tried[item][1])
    return reading, *tried[reading]


class _Products(NamedTuple):
    """Inverse W of the covariance of readings and noise, and its inner products with all columns but the difference."""

    weight: Vector
    own: Vector
    """1 + s_r^2 g^T diag(weight) g of each part."""
    factor: Matrix
    """Cholesky factor of I + M^T W M, with the modes M of noise."""
    across: Matrix
    """M^T W times F, D and H, in the basis of `factor`."""
    gram: Matrix
    log_determinant: float


class _Columns:
    """Columns of one covariance and its errors, ordered by parts of curves, and their inner products."""

    def __init__(self, whitening: Whitening, patterns: ErrorPatterns) -> None:
        self.order = np.argsort(patterns.part, kind="stable")
        self._first = np.flatnonzero(np.diff(patterns.part[self.order], prepend=-1))
        self._variance, self._reading = whitening.deviation[self.order] ** 2, patterns.reading[self.order]
        modes = np.zeros((len(self.order), 0)) if whitening.modes is None else whitening.modes
        columns = [modes, patterns.frequency, patterns.damping, patterns.shape]
        self._all = np.column_stack(columns)[self.order]
        self.modes, self.columns = self._all[:, : modes.shape[1]], self._all[:, modes.shape[1] :]
        self._known: OrderedDict[float, _Products] = OrderedDict()

    def products(self, reading: float) -> _Products:
        """Inner products at a size of the errors of readings."""
        if reading not in self._known:
            self._known[reading] = self._compute(reading)
            if len(self._known) > RETAINED:
                self._known.popitem(last=False)
        self._known.move_to_end(reading)
        return self._known[reading]

    def _compute(self, reading: float) -> _Products:
        weight = 1 / (self._variance + (reading * self._reading) ** 2)
        own = 1 + reading**2 * np.add.reduceat(weight * self._reading**2, self._first)
        # A product of W^(1/2) times all columns with its own transpose takes half the work.
        root, c = np.sqrt(weight)[:, None] * self._all, self.modes.shape[1]
        along = np.add.reduceat((reading * np.sqrt(weight) * self._reading)[:, None] * root, self._first, axis=0)
        along /= np.sqrt(own)[:, None]
        inner = root.T @ root - along.T @ along
        factor = np.asarray(np.linalg.cholesky(np.eye(c) + inner[:c, :c]), dtype=np.float64)
        half = scipy.linalg.solve_triangular(factor, inner[:c, c:], lower=True)
        log_determinant = np.log(own).sum() - np.log(weight).sum() + 2 * np.log(np.diag(factor)).sum()
        # Round-off may make the difference indefinite.
        values, vectors = np.linalg.eigh(inner[c:, c:] - half.T @ half)
        gram = (vectors * np.maximum(values, 0.0)) @ vectors.T
        return _Products(weight, own, factor, half, gram, float(log_determinant))

    def apply_inverse(self, reading: float, weight: Vector, own: Vector, difference: Vector) -> Vector:
        """Inverse of the covariance of readings and noise, without the modes, times a difference."""
        weighed = weight * difference
        sums = np.add.reduceat(self._reading * weighed, self._first) / own
        counts = np.diff(self._first, append=len(weight))
        return np.asarray(weighed - reading**2 * weight * self._reading * np.repeat(sums, counts))


#: Columns of the covariances in use.
_prepared: WeakKeyDictionary[ErrorPatterns, WeakKeyDictionary[Whitening, _Columns]] = WeakKeyDictionary()


class ErrorSizeDensity:
    """-2 ln p of sizes, up to a constant; parameters as for `estimate_error_size`."""

    def __init__(self, whitening: Whitening, patterns: ErrorPatterns, usual: ErrorSize, difference: Vector) -> None:
        prepared = _prepared.setdefault(patterns, WeakKeyDictionary())
        if whitening not in prepared:
            prepared[whitening] = _Columns(whitening, patterns)
        self._of = prepared[whitening]
        self._difference = difference[self._of.order]
        self._scale = np.array([usual.frequency, usual.damping, usual.shape])
        self._usual_reading = usual.reading
        self._kind = np.repeat(
            [0, 1, 2], [patterns.frequency.shape[1], patterns.damping.shape[1], patterns.shape.shape[1]]
        )

    def __call__(self, size: ErrorSize) -> float:
        """-2 ln p of a size."""
        return self._at(size.reading)(np.array([size.frequency, size.damping, size.shape]))[0]

    def minimise(self, reading: float, near: Sizes | None = None) -> tuple[Sizes, float]:
        """Most probable other sizes for a size of the errors of readings, and -2 ln p.

        Parameters
        ----------
        reading
            Size of the errors of readings [-].
        near
            Start values of the other sizes, from a size nearby; by default all combinations of `FIRST_SIZES` are tried.
        """
        at, there = self._at(reading), self._scale > 0
        lists = [FIRST_SIZES if item else (0.0,) for item in there]
        starts = [self._scale * share for share in product(*lists)] if near is None else [near]
        first = min(starts, key=lambda sizes: at(sizes)[0])
        if not there.any():
            return first, at(first)[0]
        import scipy.optimize

        def cost(logarithm: Vector) -> tuple[float, Vector]:
            sizes = np.zeros(3)
            sizes[there] = np.exp(logarithm)
            value, slope = at(sizes)
            return value, slope[there]

        scale = np.log(self._scale[there])
        lower, upper = scale + np.log(MIN_SIZE), scale + np.log(MAX_SIZE)
        start = np.log(np.maximum(first[there], MIN_SIZE * self._scale[there]))
        result = scipy.optimize.minimize(
            cost, start, jac=True, method="L-BFGS-B", bounds=list(zip(lower, upper, strict=True)),
            options={"ftol": 1e-10, "gtol": 1e-3},
        )  # fmt: skip
        sizes = np.zeros(3)
        sizes[there] = np.exp(result.x)
        return sizes, float(result.fun)

    def _at(self, reading: float) -> "_AtReading":
        of, known = self._of, self._of.products(reading)
        difference = of.apply_inverse(reading, known.weight, known.own, self._difference)
        along = scipy.linalg.solve_triangular(known.factor, of.modes.T @ difference, lower=True)
        prior = 2 * np.log1p((reading / self._usual_reading) ** 2) if self._usual_reading else 0.0
        return _AtReading(
            known.gram, of.columns.T @ difference - known.across.T @ along,
            float(self._difference @ difference - along @ along + known.log_determinant + prior),
            self._kind, self._scale,
        )  # fmt: skip


class _AtReading(NamedTuple):
    """-2 ln p at one size of the errors of readings."""

    gram: Matrix
    along: Vector
    rest: float
    """-2 ln p without any other error."""
    kind: NDArray[np.int64]
    scale: Sizes

    def __call__(self, sizes: Sizes) -> tuple[float, Sizes]:
        """-2 ln p, and its derivatives with respect to the logarithms of the sizes."""
        by_column = sizes[self.kind]
        along, inner = by_column * self.along, np.outer(by_column, by_column) * self.gram
        inner[np.diag_indices_from(inner)] += 1.0
        factor = np.linalg.cholesky(inner)
        inverse = scipy.linalg.lapack.dtrtri(factor, lower=1)[0] if len(factor) else factor
        # Most probable errors in standard deviations, and their posterior over prior variance.
        errors, left = (inverse @ along) @ inverse, np.sum(inverse**2, axis=0)
        share = np.where(self.scale > 0, sizes / np.where(self.scale > 0, self.scale, 1.0), 0.0) ** 2
        value = self.rest - along @ errors + 2 * np.log(np.diag(factor)).sum() + 2 * np.log1p(share).sum()
        slopes = np.bincount(self.kind, 2 * (1 - left) - 2 * errors**2, minlength=3) + 4 * share / (1 + share)
        return float(value), slopes
