r"""Transformation of coefficients into features that are nearly linear in the parameters of a model.

A resonance shift by its width changes X by its own size, while the inverse F / X remains nearly linear. Therefore:

- motion, harmonic 1: the dynamic stiffness D = F / X_1. At an antiresonance, where the share of a sensor in the
  reference motion is far below its usual value, this is not linear, and the ratio to the reference motion is used;
- higher harmonics, and forces of harmonics 1 and up: the ratio to the fundamental of the reference motion, X_k / X_1 or
  T_k / X_1 (a contact's complex stiffness);
- static parts: unchanged.

The reference motion of a state is its largest fundamental, which has the smallest relative noise. For a sensor without
phase the features are moduli: F / |X_1|, |X_k| / |X_1|; a sensor with a phase refers to a motion with a phase.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.prediction import Points
from correlation.row_group import group_rows

Coefficients = Complex[NDArray[np.complex128], " k"]

#: Relative scatter of a reading between repeats above which the difference is noise rather than a frequency shift.
UNSTEADY = 0.2
#: Share of a sensor's usual part of the reference motion below which it is at an antiresonance.
DIP = 0.3


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureVector:
    """Transformation of complex coefficients at some points into real features.

    Parameters
    ----------
    points
        Rows.
    fundamental
        Mask of first harmonics of motions, shape (k,).
    inverse
        Mask of these rows with the feature F / X, shape (k,).
    reference
        Reference row of a ratio, shape (k,); -1 without a ratio.
    real_only
        Mask of rows with a single number: no imaginary part (harmonic 0), or no phase, shape (k,).
    amplitude
        Mask of these rows without a phase, whose feature is a modulus, shape (k,).
    """

    points: Points
    fundamental: Bool[NDArray[np.bool_], " k"]
    inverse: Bool[NDArray[np.bool_], " k"]
    reference: Int[NDArray[np.int64], " k"]
    real_only: Bool[NDArray[np.bool_], " k"]
    amplitude: Bool[NDArray[np.bool_], " k"]

    @classmethod
    def choose(
        cls,
        points: Points,
        value: Coefficients,
        motion: Bool[NDArray[np.bool_], " k"],
        phased: Bool[NDArray[np.bool_], " k"] | None = None,
    ) -> "FeatureVector":
        """Choose features.

        Parameters
        ----------
        points
            Rows.
        value
            Measured coefficients, shape (k,).
        motion
            Whether a row belongs to a motion sensor, shape (k,).
        phased
            Whether a row has a phase, shape (k,); all by default.
        """
        phased = np.ones(len(points), dtype=np.bool_) if phased is None else phased
        fundamental = motion & (points.harmonic == 1)
        reference = np.full(len(points), -1, dtype=np.int64)
        columns = (points.free, points.level, points.frequency, points.sweep)
        state = list(zip(*(column.tolist() for column in columns), strict=True))
        # For numbers with a phase the largest motion that has one; for moduli the largest of all.
        for needed, rows in ((True, phased), (False, ~phased)):
            largest: dict[tuple[float, ...], int] = {}
            for row in np.flatnonzero(fundamental & np.isfinite(value) & (phased | (not needed))):
                if state[row] not in largest or abs(value[row]) > abs(value[largest[state[row]]]):
                    largest[state[row]] = int(row)
            for row in np.flatnonzero((points.harmonic > 0) & rows):
                reference[row] = largest.get(state[row], -1)
        reference[fundamental & ~_find_dips(points, value, fundamental, reference)] = -1
        return cls(
            points=points,
            fundamental=fundamental,
            inverse=fundamental & (reference < 0),
            reference=reference,
            real_only=(points.harmonic == 0) | ~phased,
            amplitude=(points.harmonic > 0) & ~phased,
        )

    @property
    def row(self) -> Int[NDArray[np.int64], " m"]:
        """Row of the points of each number: real parts first, then imaginary ones, shape (m,)."""
        return np.concatenate([np.arange(len(self.points)), np.flatnonzero(~self.real_only)])

    @property
    def state(self) -> Int[NDArray[np.int64], " m"]:
        """Index of the steady state of each number: configuration, level, frequency, and sweep if on two branches."""
        points = self.points
        return group_rows([points.free, points.level, points.frequency, points.sweep]).number[self.row]

    def of_values(self, value: Complex[NDArray[np.complex128], "k ..."]) -> Float[NDArray[np.float64], "m ..."]:
        """Features of coefficients, shape (k,) or (k, n) for n sets of them."""
        level = self.points.force.reshape(-1, *[1] * (value.ndim - 1))
        features = np.array(value, dtype=np.complex128)
        ratio = self.reference >= 0
        # NaN without a steady state.
        with np.errstate(invalid="ignore"):
            features[self.inverse] = level[self.inverse] / value[self.inverse]
            features[ratio] = value[ratio] / value[self.reference[ratio]]
        features[self.amplitude] = np.abs(features[self.amplitude])
        return self._real(features)

    def values(self, number: Float[NDArray[np.float64], " m"]) -> Coefficients:
        """Coefficients with these features, shape (k,); the inverse of `of_values`."""
        k = len(self.points)
        features = number[:k].astype(np.complex128)
        features[~self.real_only] += 1j * number[k:]
        value = features.copy()
        value[self.inverse] = self.points.force[self.inverse] / features[self.inverse]
        ratio = self.reference >= 0
        value[ratio] = features[ratio] * value[self.reference[ratio]]
        value[self.amplitude] = np.abs(value[self.amplitude])
        return value

    def of_repeats(
        self, repeat: Complex[NDArray[np.complex128], "k R"], taken: Bool[NDArray[np.bool_], "k R"]
    ) -> Float[NDArray[np.float64], " m"]:
        """Mean of the features over the selected repeats, shape (m,).

        If repeats differ by a shift of the resonance, features are linear in it and coefficients are not: the inverse
        of the mean coefficient would be biased. If noise dominates a reading, the inverse of the reading is biased, so
        that the coefficients are averaged first.
        """
        count = np.maximum(taken.sum(axis=1), 1)
        mean = np.where(taken, repeat, 0.0).sum(axis=1) / count
        apart = np.where(taken, np.abs(repeat - mean[:, None]) ** 2, 0.0).sum(axis=1) / count
        with np.errstate(invalid="ignore", divide="ignore"):
            features = self.of_values(np.where(taken, repeat, np.nan))
        rows = self.row
        averaged = np.where(taken[rows], features, 0.0).sum(axis=1) / count[rows]
        steady = (np.sqrt(apart) < UNSTEADY * np.abs(mean))[rows] & np.isfinite(averaged)
        return np.where(steady, averaged, self.of_values(mean))

    def slopes(
        self, value: Coefficients, slopes: Complex[NDArray[np.complex128], "k p"]
    ) -> Float[NDArray[np.float64], "m p"]:
        """Derivatives of the features from those of the coefficients."""
        x, changed = value[:, None], np.array(slopes, dtype=np.complex128)
        i, ratio = self.inverse, self.reference >= 0
        to = self.reference[ratio]
        # NaN without a steady state.
        with np.errstate(invalid="ignore"):
            changed[i] = -self.points.force[i, None] / x[i] ** 2 * slopes[i]
            changed[ratio] = slopes[ratio] / x[to] - x[ratio] / x[to] ** 2 * slopes[to]
        changed[self.amplitude] *= self._turned(value)[:, None]
        return self._real(changed)

    def _turned(self, value: Coefficients) -> Complex[NDArray[np.complex128], " a"]:
        """Unit complex numbers that rotate the complex features of amplitudes to the real axis, shape (a,)."""
        rows, feature = self.amplitude, np.array(value, dtype=np.complex128)
        ratio = rows & (self.reference >= 0)
        with np.errstate(invalid="ignore", divide="ignore"):
            feature[rows & self.inverse] = 1 / value[rows & self.inverse]
            feature[ratio] = value[ratio] / value[self.reference[ratio]]
            return np.asarray((np.conj(feature) / np.abs(feature))[rows])

    def per_reading(self, value: Coefficients) -> Float[NDArray[np.float64], " m"]:
        """Modulus of the derivative of each feature by its reading (the noise of the reference is negligible)."""
        rate = np.ones(len(value))
        i = self.inverse
        rate[i] = self.points.force[i] / np.abs(value[i]) ** 2
        ratio = self.reference >= 0
        rate[ratio] = 1 / np.abs(value[self.reference[ratio]])
        return np.asarray(rate[self.row])

    def _real(self, features: Complex[NDArray[np.complex128], "k ..."]) -> Float[NDArray[np.float64], "m ..."]:
        return np.concatenate([features.real, features.imag[~self.real_only]])


def _find_dips(
    points: Points,
    value: Coefficients,
    fundamental: Bool[NDArray[np.bool_], " k"],
    reference: Int[NDArray[np.int64], " k"],
) -> Bool[NDArray[np.bool_], " k"]:
    """Mask of fundamentals at an antiresonance: share in the reference motion far below its usual value."""
    rows, result = np.flatnonzero(fundamental), np.zeros(len(points), dtype=np.bool_)
    # Where no steady state was found, or nothing moves, there is no share.
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.abs(value[rows] / value[reference[rows]])
    for free in (False, True):
        for sensor in np.unique(points.sensor[rows]):
            of = (points.free[rows] == free) & (points.sensor[rows] == sensor)
            if np.isfinite(share[of]).any():
                result[rows[of]] = share[of] < DIP * np.nanmedian(share[of])
    return result
