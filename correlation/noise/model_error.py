r"""Model error: what keeps a model apart from its measurements beside noise, histories and the errors that were stated.

A real structure is never its model plus one effect. Natural frequencies and damping are a little off, in another way
where other contacts slip, and each curve by a little of its own. The covariance of the differences is then

.. math:: C = S + s_f^2 F F^T + s_d^2 D D^T + s_r^2 (G G^T + \operatorname{diag} g^2)

with the changes F and D of all features by a relative error of natural frequencies and of damping, of each
configuration at each level, and the modulus g of each feature; a column of G is g on a quarter of one curve, since
errors of a model are smooth in frequency. The sizes s are those of the largest posterior density

.. math:: -2 \ln p = r^T C^{-1} r + \ln \det C + \sum_i 2 \ln (1 + (s_i / s_{0i})^2)

with priors of Cauchy's form: small errors are the rule, and large ones are believed when they are seen.

References
----------
Kennedy and O'Hagan, Bayesian calibration of computer models, J. R. Stat. Soc. B 63 (2001), 425-464: discrepancy of a
model as a part of the covariance; Gelman, Prior distributions for variance parameters, Bayesian Anal. 1 (2006),
515-534: half-Cauchy priors of standard deviations.
"""

from dataclasses import astuple, dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from correlation.configuration import Tangent
from correlation.feature.vector import FeatureVector
from correlation.model import Model
from correlation.noise.covariance import Whitening
from correlation.noise.nuisance import NOTHING, ModelFeatures, Modes, make_frequency_shifts, split_by_level
from correlation.prediction import Prediction, Predictor
from geometry.plain_number import plain
from hbsolve.model_rates import MatrixParameter, ModelParameter

Vector = Float[NDArray[np.float64], " m"]

#: Usual errors of frequencies and of damping, over those of readings: at a peak of a quality factor of 50 both then
#: change readings by twenty times as much as far from it [-].
USUAL = (0.2, 20.0)
#: Sizes beyond which a model is another structure: what frequencies and damping are off by is then no small change.
FAR = (0.02, 0.5, 0.1)
#: Fall of -2 ln p by all sizes together from which on there is an error: of three sizes whose true value is zero,
#: chance does so in about 5 % (half a chi-square of one degree of freedom each).
NOTICED = 4.0
#: A size below this share of what is usual is none [-].
SMALL = 0.05
#: Parts of a curve with an error of their own.
PARTS = 4
#: First sizes that are tried, in units of the prior's.
TRIED = (1.0, 10.0, 100.0)


@dataclass(frozen=True)
class ErrorSize:
    """Standard deviations of the relative errors of a model [-].

    Parameters
    ----------
    frequency, damping
        Of natural frequencies, and of damping, of each configuration at each level.
    reading
        Of each part of a curve, and of each number beside.
    """

    frequency: float = 0.0
    damping: float = 0.0
    reading: float = 0.0

    @property
    def is_far(self) -> bool:
        """Whether a model with such errors is too far from its measurements for what is missing to be told."""
        return any(mine > far for mine, far in zip(astuple(self), FAR, strict=True))

    @property
    def words(self) -> str:
        """The sizes that are not zero, in words."""
        named = zip(("natural frequencies", "damping", "the readings of a curve"), astuple(self), strict=True)
        return " and ".join(f"{plain(100 * value)} % in {name}" for name, value in named if value)

    @classmethod
    def usual(cls, reading: float) -> "ErrorSize":
        """Usual errors of a model whose readings err by so much far from resonances [-]."""
        return cls(frequency=USUAL[0] * reading, damping=USUAL[1] * reading, reading=reading)

    def is_near(self, other: "ErrorSize", share: float) -> bool:
        """Whether all sizes agree within a share of the larger one."""
        return all(abs(a - b) <= share * max(a, b) for a, b in zip(astuple(self), astuple(other), strict=True))

    def scaled(self, share: float) -> "ErrorSize":
        """A share of it."""
        return ErrorSize(*(share * size for size in astuple(self)))


NO_ERROR = ErrorSize()


@dataclass(frozen=True, kw_only=True, eq=False)
class ErrorPatterns:
    """Changes of all features by errors of a model of 100 %.

    Parameters
    ----------
    frequency, damping
        F and D, shapes (m, a) and (m, b).
    reading
        g, shape (m,).
    part
        Number of the column of G that each feature belongs to, shape (m,).
    """

    frequency: Modes
    damping: Modes
    reading: Vector
    part: Int[NDArray[np.int64], " m"]

    @classmethod
    def at(
        cls, features: FeatureVector, predictor: Predictor, model: Model, prediction: Prediction, measured: Vector
    ) -> "ErrorPatterns":
        """Patterns at a model and its prediction.

        Parameters
        ----------
        features, predictor
            Features of the measurements, and a predictor of the same points.
        model, prediction
            Model and its prediction.
        measured
            Features of the measurements, shape (m,), whose moduli the errors of readings are relative to.
        """
        nominal = ModelFeatures(predictor.share(model), features, model, prediction)
        damped = ModelParameter(matrices=MatrixParameter(damping=model.system.damping))
        damping = [Tangent(jointed=damped, free=NOTHING, gain={}), Tangent(jointed=NOTHING, free=damped, gain={})]
        changes = nominal.slopes([*make_frequency_shifts(model, by_exciter=False), *damping])
        return cls(
            frequency=_by_level(features, changes[:, :2]),
            damping=_by_level(features, changes[:, 2:]),
            reading=compute_moduli(features, measured),
            part=_parts(features),
        )

    def modes(self, size: ErrorSize) -> Modes:
        """Columns of s_f F, s_d D and s_r G that are not zero, shape (m, c)."""
        columns = np.zeros((len(self.part), int(self.part.max(initial=-1)) + 1))
        columns[np.arange(len(self.part)), self.part] = size.reading * self.reading
        more = np.column_stack([size.frequency * self.frequency, size.damping * self.damping, columns])
        return np.asarray(more[:, more.any(axis=0)])

    def widen(self, whitening: Whitening, size: ErrorSize) -> Whitening:
        """Whitening with errors of a size in its covariance."""
        deviation = np.hypot(whitening.deviation, size.reading * self.reading)
        return Whitening(deviation=deviation, modes=whitening.modes).with_modes(self.modes(size))


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelError:
    """Model error in a covariance: the covariance without it, its patterns, its usual and its estimated size."""

    without: Whitening
    patterns: ErrorPatterns
    usual: ErrorSize
    size: ErrorSize = NO_ERROR

    @property
    def whitening(self) -> Whitening:
        """Covariance with it."""
        return self.patterns.widen(self.without, self.size)

    def estimated(self, difference: Vector) -> "ModelError":
        """The same with the size that a difference of measured and predicted features, shape (m,), makes probable."""
        return replace(self, size=estimate_error_size(self.without, self.patterns, self.usual, difference))

    @property
    def prior(self) -> float:
        """-2 ln of the prior density of its size, 0 without an error."""
        return compute_prior(self.size, self.usual)


def estimate_error_size(
    whitening: Whitening, patterns: ErrorPatterns, usual: ErrorSize, difference: Vector
) -> ErrorSize:
    """Most probable sizes of the errors of a model; none where they explain no more than chance.

    Parameters
    ----------
    whitening
        S.
    patterns
        F, D and G.
    usual
        Scales of the priors; there is no error of a kind whose scale is zero.
    difference
        Measured less predicted features, shape (m,).
    """
    scale = np.array(astuple(usual))
    density, there = _Density(whitening, patterns, usual, difference), scale > 0
    shares = [(0.0, *TRIED) if each else (0.0,) for each in there]
    tried = [scale * share for share in np.array(np.meshgrid(*shares)).reshape(3, -1).T]
    first = min(tried, key=density)

    def sizes(logarithm: Float[NDArray[np.float64], " k"]) -> Float[NDArray[np.float64], " 3"]:
        full = np.zeros(3)
        full[there] = np.exp(logarithm)
        return full

    def cost(logarithm: Float[NDArray[np.float64], " k"]) -> float:
        return density(sizes(logarithm))

    # What is zero at first may grow from a hundredth of the usual size.
    start = np.log(np.maximum(first, 1e-2 * scale)[there])
    import scipy.optimize  # takes long, and a comparison without model error has no use for it

    found = scipy.optimize.minimize(cost, start, method="Nelder-Mead", options={"xatol": 0.03, "fatol": 0.05})
    final = sizes(found.x)
    if density(final) > density(np.zeros(3)) - NOTICED:
        return NO_ERROR
    return ErrorSize(*np.where(final < SMALL * scale, 0.0, final).tolist())


def compute_prior(size: ErrorSize, usual: ErrorSize) -> float:
    """-2 ln of the prior density of a size, 0 without an error."""
    pairs = zip(astuple(size), astuple(usual), strict=True)
    return float(sum(2 * np.log1p((each / scale) ** 2) for each, scale in pairs if scale))


class _Density:
    """-2 ln p of sizes, up to a constant.

    The parts of curves do not overlap, so that their inverse is known in closed form; all other modes follow by
    Woodbury's identity.
    """

    def __init__(self, whitening: Whitening, patterns: ErrorPatterns, usual: ErrorSize, difference: Vector) -> None:
        self._usual = usual
        order = np.argsort(patterns.part, kind="stable")
        self._first = np.flatnonzero(np.diff(patterns.part[order], prepend=-1))
        modes = np.zeros((len(order), 0)) if whitening.modes is None else whitening.modes
        self._modes = np.column_stack([modes, patterns.frequency, patterns.damping, difference])[order]
        self._counts = [modes.shape[1], patterns.frequency.shape[1], patterns.damping.shape[1], 1]
        self._variance, self._reading = whitening.deviation[order] ** 2, patterns.reading[order]
        self._grams: dict[float, tuple[NDArray[np.float64], float]] = {}

    def __call__(self, size: Vector) -> float:
        frequency, damping, reading = (float(each) for each in size)
        gram, log_determinant = self._gram(reading)
        scale = np.repeat([1.0, frequency, damping, 1.0], self._counts)
        scaled = gram * np.outer(scale, scale)
        inner, along = scaled[:-1, :-1] + np.eye(len(scaled) - 1), scaled[:-1, -1]
        factor = np.linalg.cholesky(inner)
        explained = np.linalg.solve(factor, along)
        quadratic = scaled[-1, -1] - explained @ explained
        log_determinant += 2 * np.log(np.diag(factor)).sum()
        return float(quadratic + log_determinant + compute_prior(ErrorSize(frequency, damping, reading), self._usual))

    def _gram(self, reading: float) -> tuple[NDArray[np.float64], float]:
        """Inner products of all columns by the inverse of the covariance of the readings, and ln det of that one."""
        if reading not in self._grams:
            weight = 1 / (self._variance + (reading * self._reading) ** 2)
            weighted = weight[:, None] * self._modes
            gram, log_determinant = self._modes.T @ weighted, -np.log(weight).sum()
            if reading:
                own = 1 + reading**2 * np.add.reduceat(weight * self._reading**2, self._first)
                sums = np.add.reduceat(self._reading[:, None] * weighted, self._first, axis=0)
                gram -= sums.T @ (reading**2 / own[:, None] * sums)
                log_determinant += np.log(own).sum()
            self._grams[reading] = np.asarray(gram), float(log_determinant)
        return self._grams[reading]


def _by_level(features: FeatureVector, changes: Modes) -> Modes:
    """Changes as one column per level; columns without a change are left out."""
    columns = np.column_stack([split_by_level(features, change) for change in changes.T])
    return np.asarray(columns[:, columns.any(axis=0)])


def compute_moduli(features: FeatureVector, measured: Vector) -> Vector:
    """Modulus of the complex number that each feature is a part of, shape (m,)."""
    squares = np.bincount(features.row, np.nan_to_num(measured) ** 2, minlength=len(features.points))
    return np.asarray(np.sqrt(squares)[features.row])


def _parts(features: FeatureVector) -> Int[NDArray[np.int64], " m"]:
    """Quarter of its curve that each feature belongs to, real and imaginary parts by themselves, shape (m,)."""
    points, row = features.points, features.row
    sensor = np.unique(points.sensor, return_inverse=True)[1]
    imaginary = np.arange(len(row)) >= len(points)
    curve = np.column_stack([sensor, points.harmonic, points.free, points.level, points.sweep])[row]
    number = np.unique(np.column_stack([curve, imaginary]), axis=0, return_inverse=True)[1].ravel()
    part = np.zeros(len(row), dtype=np.int64)
    for each in np.unique(number):
        own = np.flatnonzero(number == each)
        rank = np.argsort(np.argsort(points.frequency[row[own]], kind="stable"), kind="stable")
        part[own] = PARTS * each + PARTS * rank // len(own)
    return np.asarray(np.unique(part, return_inverse=True)[1]).ravel()
