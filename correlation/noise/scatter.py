r"""Covariance of the mean of repeats: jitter that changes all points at once, and noise of each point.

Repeats differ by more than noise: frequency of the exciter, preload and temperature vary. Such a jitter changes all
points along a known mode. Apart from these modes, readings X of one sensor and harmonic have the variance

.. math:: v = a^2 |X|^2 + b^2 .

Few repeats give an inaccurate variance. The variance of each point is therefore shrunk towards this one, but only in
part, since the scatter by friction differs between states.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray
from scipy.special import chdtri

from correlation.campaign.measurement import name_configuration
from correlation.errors import CampaignError
from correlation.feature.observation import Observation
from correlation.feature.reading_noise import FREEDOM, LEAST_REPEATED
from correlation.feature.vector import FeatureVector
from correlation.noise.covariance import Whitening
from correlation.noise.nuisance import FORCES
from correlation.noise.rice import remove_bias
from correlation.noise.variance import compute_margin, fit_two_shares

Variance = Float[NDArray[np.float64], " m"]

#: Weight of the pooled variance relative to that of a point, in degrees of freedom [-].
POOLED_FREEDOM = 6.0
#: Share of the change by friction histories that counts as independent noise, since a few linear modes do not span the
#: changes at the onset of slip. For specimens without any effect, estimated contact effects then agree with their
#: intervals [-].
HISTORY_NOISE_SHARE = 0.2
#: Weight of the common scatter relative to that of a state, as a multiple of `POOLED_FREEDOM` [-].
COMMON_SCATTER = 4.0
#: Upper limit of the ratio of a variance to the pooled one in the scatter of a state; a larger ratio means that the
#: pooling failed [-].
MOST_EXCESS_SCATTER = 10.0
#: Tail probability of chi-square that limits the ratio of a variance to the fitted one in the fit of a and b: at an
#: antiresonance, or at the onset of slip, the variance may be a hundred times as large. With four degrees of freedom
#: the limit is 4.
TAIL = 0.003
#: Usual standard deviations of jitter without repeats: frequencies and forces of the jointed and of the free test, and
#: preloads [-]. The force is taken as measured.
USUAL_JITTER = (3e-4, 3e-4, 0.0, 0.0, 1e-2)
#: Significance level of the jitter of the force: it is zero unless repeats differ along it by more than noise does in
#: this share of campaigns [-].
FORCE_CHANCE = 0.01
#: Prior standard deviation of jitter, chosen for preloads [-].
JITTER_PRIOR = 0.2
#: Rounds of the weighted fit of a and b, and the least variance over the mean square of the readings [-].
ROUNDS, LEAST_VARIANCE = 6, 1e-12


def estimate_scatter(
    observed: Observation,
    features: FeatureVector,
    jitter: Sequence[Float[NDArray[np.float64], "m q"]],
    history: Float[NDArray[np.float64], "m h"],
    budget: Float[NDArray[np.float64], "m b"],
) -> "Scatter":
    """Covariance of the mean of the selected repeats, estimated from all repeats.

    Parameters
    ----------
    observed
        Repeats.
    features
        Features of the same points.
    jitter
        Modes of jitter, in any unit; their sizes are estimated. Modes of one cause, such as the preloads of all lines,
        form one block, within which they may be correlated; causes are independent.
    history
        Modes of friction histories, at one standard deviation of a single repeat.
    budget
        Modes of errors common to all repeats (discretisation, calibration of sensors), at one standard deviation.

    Returns
    -------
    Scatter
        The covariance, and the covariance of the amplitudes of each cause of jitter in one repeat.

    Raises
    ------
    CampaignError
        Fewer than two repeats, and the noise is neither stated nor can be estimated from the curves.
    """
    n = np.isfinite(observed.repeat).sum(axis=1)[features.row]
    if np.mean(n > 1) < LEAST_REPEATED:
        return _make_single_repeat_scatter(observed, features, jitter, history, budget)
    with np.errstate(invalid="ignore"):
        values = features.of_values(observed.repeat)
    mean = np.nanmean(values, axis=1)
    apart, freedom = values - mean[:, None], np.maximum(n - 1.0, 0.0)
    pooled = _pool_variance(observed, features, _compute_variance(apart, freedom), freedom)
    _require_noise(observed, features, np.sqrt(pooled))
    weights = Whitening(deviation=np.sqrt(pooled), modes=history)
    amplitude, covariances = _estimate_jitter(apart, jitter, weights, freedom)
    rest = apart - np.column_stack(jitter) @ amplitude
    own = _compute_variance(rest - weights.explained(np.nan_to_num(rest)), freedom)
    pooled = _pool_variance(observed, features, own, freedom)
    noise = np.sqrt(pooled)
    pooled = pooled * _estimate_excess_scatter(own / pooled, freedom, features.state)
    variance = (POOLED_FREEDOM * pooled + freedom * np.where(freedom > 0, own, 0.0)) / (POOLED_FREEDOM + freedom)
    variance += HISTORY_NOISE_SHARE**2 * (history**2).sum(axis=1)
    together = [
        block @ _find_principal_modes(covariance) for block, covariance in zip(jitter, covariances, strict=True)
    ]
    count = observed.count[features.row]
    shared = np.column_stack([*together, history]) / np.sqrt(count)[:, None]
    deviation = np.sqrt(variance / np.maximum(count, 1))
    bias = _estimate_bias(
        features, mean, np.sqrt(compute_margin(FREEDOM)) * _compute_noise_of_reading(observed, features, noise)
    )
    return Scatter(Whitening(deviation=deviation, modes=np.column_stack([shared, budget, bias])), covariances, noise)


class Scatter(NamedTuple):
    """Covariance from repeats."""

    whitening: Whitening
    """The first modes are those of the jitter, in the order of its causes."""
    jitter: list[Float[NDArray[np.float64], "q q"]]
    """Covariance of the jitter of a single repeat, for each cause, with the margin for `CAUTION`."""
    noise: Variance
    """Standard deviation of each feature in a single repeat by the pooled noise of its sensor."""


def _make_single_repeat_scatter(
    observed: Observation,
    features: FeatureVector,
    jitter: Sequence[Float[NDArray[np.float64], "m q"]],
    history: Float[NDArray[np.float64], "m h"],
    budget: Float[NDArray[np.float64], "m b"],
) -> Scatter:
    """Covariance of a single repeat with known noise; its frequency and preload have usual jitter."""
    noise = features.per_reading(observed.mean) * observed.noise[features.row]
    _require_noise(observed, features, noise)
    deviation = np.sqrt(noise**2 + HISTORY_NOISE_SHARE**2 * (history**2).sum(axis=1))
    usual = [size**2 * np.eye(block.shape[1]) for size, block in zip(USUAL_JITTER, jitter, strict=False)]
    bias = _estimate_bias(
        features, features.of_values(observed.mean), _compute_noise_of_reading(observed, features, noise)
    )
    shared = [size * block for size, block in zip(USUAL_JITTER, jitter, strict=False)]
    return Scatter(
        Whitening(deviation=deviation, modes=np.column_stack([*shared, history, budget, bias])), usual, noise
    )


def _require_noise(observed: Observation, features: FeatureVector, noise: Variance) -> None:
    """Reject features of unknown noise.

    Raises
    ------
    CampaignError
        The noise of a feature is unknown; the message names its sensor.
    """
    unknown = np.flatnonzero(~(noise > 0))
    if len(unknown):
        row = features.row[unknown[0]]
        test = name_configuration(observed.points.free[row])
        raise CampaignError(
            f'sensor "{observed.points.sensor[row]}", harmonic {observed.points.harmonic[row]}, {test} test: a '
            "single repeat with too few frequencies does not show its noise: repeat the test, or state the noise of "
            "the sensor "
            '(noise = "1 %")'
        )


def _estimate_bias(
    features: FeatureVector, value: Variance, of_one_reading: Variance
) -> Float[NDArray[np.float64], "m g"]:
    """Bias of each modulus without a phase by noise, one mode for each sensor and harmonic."""
    moduli, group = (features.amplitude & (features.reference >= 0))[features.row], _number_groups(features)
    bias = np.where(moduli, value - remove_bias(value, of_one_reading), 0.0)
    return np.where(group[:, None] == np.unique(group[moduli]), np.nan_to_num(bias)[:, None], 0.0)


def _compute_noise_of_reading(observed: Observation, features: FeatureVector, noise: Variance) -> Variance:
    """Noise of one reading from that of a repeat, which is the mean of several readings, shape (m,)."""
    return np.asarray(noise * np.sqrt(observed.n_reading)[features.row])


def _estimate_jitter(
    apart: Float[NDArray[np.float64], "m R"],
    jitter: Sequence[Float[NDArray[np.float64], "m q"]],
    weights: Whitening,
    freedom: Float[NDArray[np.float64], " m"],
) -> tuple[Float[NDArray[np.float64], "q R"], list[Float[NDArray[np.float64], "q q"]]]:
    """Amplitudes of all modes of jitter in each repeat, and covariance of the amplitudes of each cause."""
    starts = np.cumsum([block.shape[1] for block in jitter])[:-1]
    amplitude, chance = _fit_amplitudes(apart, np.column_stack(jitter), weights)
    repeats = [_find_repeats(block, apart) for block in jitter]
    covariances = [
        compute_margin(int(item.sum()) - 1) * _estimate_covariance(rows[:, item])
        for rows, item in zip(np.split(amplitude, starts), repeats, strict=True)
    ]
    by_chance = np.split(np.divide(amplitude, chance, out=np.zeros_like(amplitude), where=chance > 0), starts)
    for number in (item for item in FORCES if item < len(jitter)):
        n_repeat = int(repeats[number].sum())
        if (by_chance[number][:, repeats[number]] ** 2).sum() < chdtri(max(n_repeat - 1, 1), FORCE_CHANCE):
            covariances[number], amplitude[number] = np.zeros_like(covariances[number]), 0.0
    # In a test without repeats the jitter has its usual size.
    for number, (usual, block) in enumerate(zip(USUAL_JITTER, jitter, strict=False)):
        if block.any() and not freedom[block.any(axis=1)].any():
            covariances[number] = usual**2 * np.eye(block.shape[1])
    return amplitude, covariances


def _estimate_covariance(amplitude: Float[NDArray[np.float64], "q R"]) -> Float[NDArray[np.float64], "q q"]:
    """Covariance of the amplitudes of one cause about zero mean, shrunk towards independence.

    Otherwise a few repeats would give a variance of zero for some combination by chance.
    """
    q, n = amplitude.shape
    covariance = amplitude @ amplitude.T / max(n - 1, 1)
    share = min(1.0, q / (2 * max(n, 1))) if q > 1 else 0.0
    return np.asarray((1 - share) * covariance + share * np.diag(np.diag(covariance)))


def _find_repeats(
    block: Float[NDArray[np.float64], "m q"], apart: Float[NDArray[np.float64], "m R"]
) -> Bool[NDArray[np.bool_], " R"]:
    """Repeats of the tests affected by a cause."""
    return np.asarray(np.isfinite(apart[block.any(axis=1)]).any(axis=0))


def _find_principal_modes(covariance: Float[NDArray[np.float64], "q q"]) -> Float[NDArray[np.float64], "q q"]:
    """Independent modes of a covariance, as columns; for random draws use `symmetric_root`."""
    sizes, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(sizes, 0.0)))


def _compute_variance(apart: Float[NDArray[np.float64], "m R"], freedom: Float[NDArray[np.float64], " m"]) -> Variance:
    return np.where(freedom > 0, np.nansum(apart**2, axis=1) / np.maximum(freedom, 1.0), np.nan)


def _number_groups(features: FeatureVector) -> NDArray[np.int64]:
    """Group of each feature: features of one sensor, harmonic and configuration have a common noise model."""
    points, row = features.points, features.row
    _, sensor = np.unique(points.sensor, return_inverse=True)
    key = np.column_stack([sensor[row], points.harmonic[row], points.free[row]])
    return np.asarray(np.unique(key, axis=0, return_inverse=True)[1]).ravel()


def _estimate_excess_scatter(
    ratio: Float[NDArray[np.float64], " m"], freedom: Float[NDArray[np.float64], " m"], state: NDArray[np.int64]
) -> Float[NDArray[np.float64], " m"]:
    """Relative scatter of the features of each state: at the onset of slip all of them scatter more."""
    seen = freedom > 0
    total = np.bincount(
        state[seen], (freedom * np.minimum(ratio, MOST_EXCESS_SCATTER))[seen], minlength=state.max() + 1
    )
    count = np.bincount(state[seen], freedom[seen], minlength=state.max() + 1)
    common = COMMON_SCATTER * POOLED_FREEDOM
    return np.asarray(((common + total) / (common + count))[state])


def _pool_variance(
    observed: Observation, features: FeatureVector, own: Variance, freedom: Float[NDArray[np.float64], " m"]
) -> Variance:
    """Variance of each feature, pooled over its sensor, harmonic and configuration, or as stated."""
    reading, group = observed.mean, _number_groups(features)
    size, per_reading = np.abs(reading)[features.row], features.per_reading(reading)
    pooled = np.full_like(own, np.nan)
    for number in range(int(group.max()) + 1):
        rows = np.flatnonzero(group == number)
        seen = rows[freedom[rows] > 0]
        if len(seen):
            mean_square = float(np.mean(size[rows] ** 2)) or 1.0
            of_reading = (own / per_reading**2)[seen]
            share = _fit_median_law(of_reading, size[seen], freedom[seen], mean_square)
            law = share[0] * size[rows] ** 2 + share[1] * mean_square
            pooled[rows] = np.maximum(law, LEAST_VARIANCE * mean_square)
    stated = per_reading * observed.noise[features.row]
    return np.where(np.isfinite(stated), stated**2, per_reading**2 * pooled)


def _fit_median_law(
    variance: Variance, size: Variance, freedom: Float[NDArray[np.float64], " m"], mean_square: float
) -> Float[NDArray[np.float64], " 2"]:
    """a^2, and b^2 over the mean square of the readings, such that half of the variances are above the law.

    `correlation.noise.variance.fit_variance_law` preserves the mean of all but a few variances, as needed for one
    curve. At the onset of slip many variances are a hundred times as large, which does not affect the median.
    """
    # The distribution of variances of two repeats is far more skewed than that of five.
    largest, median = (np.asarray(chdtri(freedom, chance) / freedom) for chance in (TAIL, 0.5))
    squared, least = size**2, LEAST_VARIANCE * mean_square
    table = np.column_stack([squared, np.full(len(size), mean_square)])
    fitted = np.maximum(squared * float(np.median(variance / np.maximum(squared, least))), least)
    share = np.zeros(2)
    for _ in range(ROUNDS):
        share = fit_two_shares(table.T, np.minimum(variance, largest * fitted), 1 / fitted**2)
        share *= np.median(variance / median / np.maximum(table @ share, least))
        fitted = np.maximum(table @ share, least)
    return share


def _fit_amplitudes(
    apart: Float[NDArray[np.float64], "m R"], modes: Float[NDArray[np.float64], "m q"], weights: Whitening
) -> tuple[Float[NDArray[np.float64], "q R"], Float[NDArray[np.float64], "q R"]]:
    """Amplitudes of the modes in each repeat by generalised least squares, and their standard deviations by noise.

    `weights` contains friction histories, which are not jitter. The amplitude of a mode with a negligible effect, such
    as the preload of a sticking contact, is not identifiable and is limited by its prior.
    """
    amplitudes, prior = np.zeros((2, modes.shape[1], apart.shape[1])), np.eye(modes.shape[1]) / JITTER_PRIOR
    for number, column in enumerate(apart.T):
        there = np.isfinite(column)
        seen, difference = np.where(there[:, None], modes, 0.0), np.where(there, column, 0.0)
        table = np.concatenate([weights(seen), prior])
        amplitudes[0, :, number] = np.linalg.lstsq(table, np.pad(weights(difference), (0, len(prior))), rcond=1e-10)[0]
        amplitudes[1, :, number] = np.sqrt(np.diag(np.linalg.pinv(table.T @ table, hermitian=True)))
    return amplitudes[0], amplitudes[1]
