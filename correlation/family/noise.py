r"""Differences of curves of a family beyond friction history: reading noise and frequency offsets of set-ups.

A friction history persists along a sweep, so that curves of one level differ smoothly over frequency; noise is not
smooth. With the difference :math:`D_j` of a curve from the mean of its family at frequency :math:`f_j`,

.. math:: r_j = D_j - \lambda D_{j-1} - (1 - \lambda) D_{j+1}, \qquad
          \operatorname{var} r_j = \sigma^2\,(1 + \lambda^2 + (1 - \lambda)^2) ,

is nearly free of history; :math:`\sigma^2 = a^2 |X|^2 + b^2` is fitted to it robustly. A relative frequency error e of
a set-up causes a difference of :math:`e f\,dX/df`, which is fitted to each curve first; this removes a part of the
noise: with s this slope and L the rows above,

.. math:: r = K D, \qquad K = L\,(1 - s s^T / s^T s), \qquad \operatorname{cov} r = \sigma^2 K K^T .

Neighbouring :math:`r_j` have common readings. With C the correlations of the n roughnesses of a curve, their mean
square has approximately a :math:`\chi^2` distribution with :math:`n^2 / \sum_{jk} C_{jk}^2` degrees of freedom
(Satterthwaite). With d of these per roughness, the information of scaled :math:`\chi^2` gives the covariance V of the
fitted :math:`(a^2, b^2)`,

.. math:: V^{-1} = \sum \frac{d}{2 \sigma^4}\,g g^T , \qquad g = (|X|^2, 1) , \qquad
          \nu(X) = \frac{2 \sigma(X)^4}{g^T V g} ,

and the degrees of freedom :math:`\nu` of the noise of a reading, which are few if no other reading is as small.

A sensor that is mounted and cabled again has another gain, within one per cent: all readings of a repeat have a common
factor. Like the frequency offset, it is estimated at the level at which repeats agree best; it counts as an error of
each reading.

Curves with fewer than four frequencies have no roughness. Their scatter at each frequency is then used as noise. It is
larger if histories differ, so that small departures from the limits remain undetected, but noise alone causes none.

References
----------
F. E. Satterthwaite, An approximate distribution of estimates of variance components, Biometrics Bulletin 2 (1946).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from correlation.campaign.measurement import Campaign
from correlation.family.family import Family, number_points
from correlation.noise.variance import compute_margin, fit_variance_law

Values = Float[NDArray[np.float64], " n"]
Table = Float[NDArray[np.float64], "c p"]

#: Least number of points of a curve for a roughness.
FEWEST_POINTS = 4
#: Roughnesses of which the fitted shift leaves less than this share of the variance are not used [-].
LEAST_LEFT = 0.1
#: Least degrees of freedom of an estimate [-].
LEAST_FREEDOM = 1.0
#: Largest difference of the gain of a sensor between repeats: the accuracy of a calibration [-].
MOST_GAIN = 0.01
#: Variance of a median over that of a mean, for normal readings [-].
MEDIAN = np.pi / 2
#: Lower limit of the smaller eigenvalue of the information on the noise law, over the larger one [-].
MIN_INFORMATION_SHARE = 1e-6


@dataclass(frozen=True, kw_only=True)
class ReadingNoise:
    """Standard deviation of one reading of a sensor and harmonic, sqrt((relative^2 + gain^2) X^2 + absolute^2).

    Parameters
    ----------
    relative
        Part proportional to the reading [-].
    absolute
        Constant part [SI unit of the sensor].
    gain
        Standard deviation of the factor common to all readings of a repeat [-].
    source
        "stated" in the manifest; estimated from the roughness of the "curves" of the families, or from their "scatter"
        at each frequency, which includes histories; or "unknown".
    covariance
        Variance of relative^2, covariance with absolute^2 and variance of absolute^2; 0 if not estimated.
    """

    relative: float = 0.0
    absolute: float = 0.0
    gain: float = 0.0
    source: str = "unknown"
    covariance: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def deviation(self, value: Values) -> Values:
        """Standard deviation of readings, shape (n,)."""
        return np.sqrt((self.relative**2 + self.gain**2) * value**2 + self.absolute**2)

    def freedom(self, value: Values, known: Values | float = 0.0) -> Values:
        """Degrees of freedom of the variance at readings, infinite if not estimated, shape (n,) [-].

        Parameters
        ----------
        value
            Readings, shape (n,).
        known
            Standard deviation of additional known errors, combined by Satterthwaite's formula.
        """
        relative, both, absolute = self.covariance
        variance = relative * value**4 + 2 * both * value**2 + absolute
        with np.errstate(divide="ignore", invalid="ignore"):
            # The gain is estimated from few repeats: it must not increase the degrees of freedom.
            own = (self.relative * value) ** 2 + self.absolute**2
            freedom = np.where(variance > 0, 2 * (own + known**2) ** 2 / variance, inf)
        return np.maximum(freedom, LEAST_FREEDOM)


@dataclass(frozen=True, kw_only=True, eq=False)
class RepeatErrors:
    """Repeat errors that the limits do not contain: noise and frequency offsets.

    Parameters
    ----------
    noise
        Noise of the readings by sensor and harmonic.
    frequency
        Relative standard deviation of the frequency between set-ups [-]; 0 with a single repeat.
    """

    noise: Mapping[tuple[str, int], ReadingNoise]
    frequency: float


def estimate_repeat_errors(campaign: Campaign, families: Sequence[Family]) -> RepeatErrors:
    """Noise as stated in the manifest, else from the roughness of the differences between curves.

    Parameters
    ----------
    campaign
        Campaign; its sensors may state their noise.
    families
        All families of the campaign.
    """
    stated = {sensor.name: sensor.noise for sensor in campaign.sensors if any(sensor.noise)}
    tables = [_make_table(family) for family in families]
    noise: dict[tuple[str, int], ReadingNoise] = {}
    for key in dict.fromkeys((family.sensor, family.harmonic) for family in families):
        group = [table for table in tables if (table.family.sensor, table.family.harmonic) == key]
        if key[0] in stated:
            relative, absolute = stated[key[0]]
            result = ReadingNoise(relative=relative, absolute=absolute, source="stated")
        else:
            result = _estimate_noise(group)
        noise[key] = replace(result, gain=min(_estimate_gain_scatter(group), MOST_GAIN) if key[1] else 0.0)
    forces = {sensor.name for sensor in campaign.sensors if sensor.line is not None}
    moving = [table for table in tables if table.family.sensor not in forces and table.family.harmonic > 0]
    return RepeatErrors(noise=noise, frequency=_estimate_frequency_jitter(moving))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Table:
    """A family as a table of c curves at p points; NaN where a curve has no reading."""

    family: Family
    frequency: Values
    value: Table

    @cached_property
    def count(self) -> NDArray[np.int64]:
        """Number of curves at each point, shape (p,)."""
        return np.asarray(np.isfinite(self.value).sum(axis=0))

    @cached_property
    def mean(self) -> Values:
        """Mean curve, shape (p,)."""
        return np.asarray(np.nansum(self.value, axis=0) / np.maximum(self.count, 1))

    @cached_property
    def apart(self) -> Table:
        """Differences from the mean of the curves; NaN at a point with a single curve."""
        return np.where(self.count > 1, self.value - self.mean, np.nan)

    @cached_property
    def unshifted(self) -> Table:
        """Differences from the mean without the effect of the frequency shifts."""
        return np.asarray(self.apart - np.nan_to_num(self.shifts)[:, None] * self.slope)

    @cached_property
    def slope(self) -> Values:
        """F dX/df of the mean curve, shape (p,); zero with too few points."""
        if len(self.frequency) < FEWEST_POINTS:
            return np.zeros_like(self.frequency)
        return np.asarray(self.frequency * Akima1DInterpolator(self.frequency, self.mean).derivative()(self.frequency))

    @cached_property
    def shifts(self) -> Values:
        """Relative frequency shift of each curve by least squares, shape (c,); NaN if not identifiable."""
        apart, slope = self.apart, self.slope
        there = np.isfinite(apart)
        size = np.where(there, slope**2, 0.0).sum(axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(np.where(there, apart, 0.0) @ slope / size)


def _make_table(family: Family) -> _Table:
    """Table of the curves; readings of a point are moved along their curve to its mean frequency."""
    point, number = number_points(family.curves), family.curve_number
    names, place = np.unique(point, return_inverse=True)
    frequency = np.bincount(place, family.frequency) / np.bincount(place)
    order = np.argsort(frequency)
    rank = np.empty(len(names), dtype=np.int64)
    rank[order] = np.arange(len(names))
    value = np.full((len(family.curves), len(names)), np.nan)
    column = rank[place]
    value[number, column] = family.value + _compute_carried_change(family, frequency[order][column])
    return _Table(family=family, frequency=frequency[order], value=value)


def _compute_carried_change(family: Family, target: Values) -> Values:
    """Change of each curve from the measured frequency to one nearby, shape (p,)."""
    result, number = np.zeros(family.n_point), family.curve_number
    for row, curve in enumerate(family.curves):
        own = number == row
        rising = np.concatenate([[True], np.diff(curve.frequency) > 0])
        if rising.sum() >= FEWEST_POINTS and not np.array_equal(curve.frequency, target[own]):
            f, x = curve.frequency[rising], curve.value[rising]
            shape = Akima1DInterpolator(f, x)
            inside = np.clip(target[own], f[0], f[-1])
            result[own] = shape(inside) - shape(np.clip(curve.frequency, f[0], f[-1]))
    return result


def _estimate_noise(tables: Sequence[_Table]) -> ReadingNoise:
    """Noise from the roughness of curves, else from the scatter at each frequency."""
    for source, estimate in (("curves", _compute_roughness(tables)), ("scatter", _scatter(tables))):
        squared, scatter, dof, effective = estimate
        if not scatter.any():
            continue
        # Readings with few digits may agree exactly.
        a2, b2 = fit_variance_law(squared, np.maximum(scatter, 1e-12 * float(scatter.max())), dof)
        covariance = _compute_law_covariance(squared, a2, b2, effective)
        return ReadingNoise(
            relative=float(np.sqrt(a2)), absolute=float(np.sqrt(b2)), source=source, covariance=covariance
        )
    return ReadingNoise()


def _compute_roughness(tables: Sequence[_Table]) -> Float[NDArray[np.float64], "4 q"]:
    """Squares of readings, variances, their degrees of freedom, and effective ones with correlated neighbours."""
    parts = [np.zeros((4, 0))]
    for table in tables:
        f, count = table.frequency, table.count
        if len(f) < FEWEST_POINTS:
            continue
        apart = table.unshifted
        share = (f[2:] - f[1:-1]) / (f[2:] - f[:-2])
        rough = apart[:, 1:-1] - share * apart[:, :-2] - (1 - share) * apart[:, 2:]
        there = np.isfinite(rough)
        seen = there.sum(axis=0)
        rows = _make_roughness_rows(share, table.slope)
        left = (rows**2).sum(axis=1)
        # Subtraction of the mean of n curves removes the share 1 / n of the variance.
        whole = left * (1 - 1 / np.maximum(count[1:-1], 2))
        use = (seen > 1) & (left > LEAST_LEFT)
        scaled = rows[use] / np.sqrt(left[use])[:, None]
        correlation = scaled @ scaled.T
        dof = (seen[use] - 1).astype(float)
        parts.append(
            np.array(
                [
                    # Weighted over the readings of each roughness.
                    (rows**2 @ table.mean**2)[use] / left[use],
                    np.where(there, rough**2, 0.0).sum(axis=0)[use] / seen[use] / whole[use],
                    dof,
                    dof * use.sum() / max(float((correlation**2).sum()), 1.0),
                ]
            )
        )
    return np.concatenate(parts, axis=1)


def _scatter(tables: Sequence[_Table]) -> Float[NDArray[np.float64], "4 q"]:
    """The same for the scatter at each frequency, which includes friction histories: an upper bound of the noise."""
    parts = [np.zeros((4, 0))]
    for table in tables:
        use = table.count > 1
        dof, mean = table.count[use] - 1.0, table.mean[use]
        parts.append(np.array([mean**2, np.nansum(table.apart**2, axis=0)[use] / dof, dof, dof]))
    return np.concatenate(parts, axis=1)


def _compute_law_covariance(squared: Values, a2: float, b2: float, dof: Values) -> tuple[float, float, float]:
    """V of the noise law, see `ReadingNoise.covariance`."""
    top = max(float(squared.max()), np.finfo(float).tiny)
    columns = np.array([squared / top, np.ones_like(squared)])
    variance = a2 * squared + b2
    information = (columns * dof / (2 * (variance / variance.max()) ** 2)) @ columns.T
    # If both columns are proportional, only their sum is identifiable: this is sufficient for readings of similar size,
    # and leaves readings of another size uncertain.
    size, vector = np.linalg.eigh(information)
    inverse = (vector / np.maximum(size, MIN_INFORMATION_SHARE * size[-1])) @ vector.T * variance.max() ** 2
    return float(inverse[0, 0] / top**2), float(inverse[0, 1] / top), float(inverse[1, 1])


def _make_roughness_rows(share: Values, slope: Values) -> Float[NDArray[np.float64], "q p"]:
    """K, the matrix from the readings of a curve to its roughnesses, shape (p - 2, p) [-]."""
    n = len(share)
    rows = np.zeros((n, n + 2))
    at = np.arange(n)
    rows[at, at], rows[at, at + 1], rows[at, at + 2] = -share, 1.0, share - 1
    size = float(slope @ slope)
    return rows - np.outer(rows @ slope, slope) / size if size else rows


def _estimate_gain_scatter(tables: Sequence[_Table]) -> float:
    """Standard deviation of the factor of a repeat beyond noise, at the level at which repeats agree best [-]."""
    result: list[float] = []
    for table in tables:
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.where(table.mean > 0, table.unshifted / table.mean, np.nan)
        of_curve = np.array([curve.repeat for curve in table.family.curves])
        own = [ratio[of_curve == repeat] for repeat in np.unique(of_curve)]
        own = [part[np.isfinite(part)] for part in own if np.isfinite(part).sum() >= FEWEST_POINTS]
        if len(own) > 1:
            noise = np.mean([MEDIAN * part.var(ddof=1) / len(part) for part in own])
            beyond = float(np.var([np.median(part) for part in own], ddof=1) - noise)
            result.append(float(np.sqrt(max(beyond, 0.0) * compute_margin(len(own) - 1))))
    return min(result, default=0.0)


def _estimate_frequency_jitter(tables: Sequence[_Table]) -> float:
    """Frequency jitter at the level with the best agreement: elsewhere friction histories shift the resonance too."""
    result: list[float] = []
    for level in sorted({table.family.level for table in tables}):
        group = [table for table in tables if table.family.level == level]
        repeats = sorted({curve.repeat for table in group for curve in table.family.curves})
        shift = []
        for repeat in repeats:
            own = [
                item
                for table in group
                for item, curve in zip(table.shifts, table.family.curves, strict=True)
                if curve.repeat == repeat and np.isfinite(item)
            ]
            if own:
                shift.append(float(np.median(own)))
        freedom = len(shift) - 1
        if freedom > 0:
            result.append(float(np.sqrt(np.var(shift, ddof=1) * compute_margin(freedom))))
    return min(result, default=0.0)
