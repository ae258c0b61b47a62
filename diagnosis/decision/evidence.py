"""Evidence for effects: gain of the training data, objection of the held-out data, and probability of each effect."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.threshold.detection_threshold import Thresholds

#: Held-out error above which it is large, set on development seeds [-].
LARGE_ERROR = 0.1
#: Probability that the named effects include the true one, given that one of the passing effects is true [-].
CREDIBLE = 0.95
#: Change of -2 ln p of the held-out data that refutes or confirms an effect: odds of 1 to 20 [-].
DECISIVE = 2 * np.log(20)


def compute_log_density(refit: Refit) -> float:
    """2 ln of the joint density of training and held-out data, by the covariance of this fit, up to a constant [-].

    Falls of chi^2 decide whether an effect is present. They cannot rank effects with different covariances; densities
    can.
    """
    return refit.gain + refit.held_out_gain if refit.cost is None else -refit.cost


def compute_whole_gain(refit: Refit) -> float:
    """Fall of -2 ln p of all data by an effect, by the worse one of two covariances [-].

    The density of `compute_log_density` uses one covariance only, which is estimated from few friction histories.
    """
    return refit.gain + refit.held_out_gain


def compute_probabilities(
    refits: Sequence[Refit],
    same: Bool[NDArray[np.bool_], "n n"] | None = None,
    weights: Sequence[Callable[[Refit], float]] = (compute_log_density,),
) -> Float[NDArray[np.float64], " n"]:
    """Probability of each of several effects, one of which is the true one, shape (n,) [-].

    Parameters
    ----------
    refits
        The effects.
    same
        Pairs that these tests cannot distinguish, shape (n, n); none by default. Such effects are equally probable:
        their densities differ only by the end points of the fits and by the covariances of their models.
    weights
        2 ln of the density that weighs an effect. With several of them the probabilities are averaged, so that a
        result on which they disagree is uncertain.
    """
    log_densities = [np.array([weigh(item) for item in refits], dtype=np.float64) for weigh in weights]
    return np.asarray(np.mean([_normalise(item, same) for item in log_densities], axis=0))


def find_credible(chances: Float[NDArray[np.float64], " n"]) -> list[int]:
    """Numbers of the fewest effects that include the true one with probability `CREDIBLE`, the most probable first."""
    order = np.argsort(-chances, kind="stable")
    count = 1 + int(np.searchsorted(np.cumsum(chances[order]), CREDIBLE))
    return [int(number) for number in order[:count]]


def _normalise(
    log_density: Float[NDArray[np.float64], " n"], same: Bool[NDArray[np.bool_], "n n"] | None
) -> Float[NDArray[np.float64], " n"]:
    """Probabilities of 2 ln of densities, shape (n,)."""
    if same is not None:
        log_density = np.where(same, log_density, -np.inf).max(axis=1, initial=-np.inf)
    weight = np.exp((log_density - log_density.max(initial=-np.inf)) / 2)
    return np.asarray(weight / weight.sum())


def compute_birge_ratio(refit: Refit, gain: float = 0.0) -> float:
    """Squared Birge ratio: reduced chi-squared of a fit, optionally after a further gain, at least 1 [-].

    It scales the detection thresholds. The covariance is itself an estimate; if a good fit leaves a reduced chi-squared
    above 1, gains scatter by that factor more (Birge, Phys. Rev. 40 (1932), 207-227).
    """
    return max((refit.fit.chi2 - gain) / refit.fit.n_number, 1.0)


def exceeds_threshold(refit: Refit, thresholds: Thresholds) -> bool:
    """Whether the gain of the training data by an effect exceeds chance; the held-out data are not considered."""
    return refit.gain > thresholds.gain * compute_birge_ratio(refit)


def passes(refit: Refit, thresholds: Thresholds) -> bool:
    """Whether the gain, less the loss of the held-out data, exceeds chance, and these do not refute the effect."""
    return bool(compute_evidence(refit) > thresholds.gain * compute_birge_ratio(refit))


def compute_evidence(refit: Refit) -> float:
    """Fall of -2 ln p of the training data less the loss of the held-out data; zero if these refute the effect [-]."""
    return 0.0 if refit.worsens else discount_gain(refit.gain, refit.held_out_gain)


def discount_gain(gain: float, held_out_gain: float) -> float:
    """Gain of the training data less the loss of the held-out data, in -2 ln p; zero if the latter is decisive [-]."""
    return 0.0 if held_out_gain <= -DECISIVE else gain + min(held_out_gain, 0.0)


def is_refuted(refit: Refit) -> bool:
    """Whether the held-out data refute an effect."""
    return refit.worsens or refit.held_out_gain <= -DECISIVE


def errs_on_held_out(refit: Refit) -> bool:
    """Whether the held-out error is large and not explained by noise and stated errors."""
    return refit.held_out_error > LARGE_ERROR and refit.held_out_reduced_chi2_by_noise > UNEXPLAINED_CHI2
