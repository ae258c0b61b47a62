"""Evidence for effects: what the training data gain, what the held-out data object, and how probable each is."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.threshold.detection_threshold import Thresholds

#: Held-out error that is large, set on development seeds [-].
LARGE_ERROR = 0.1
#: Probability that one of the effects that are named is the true one, if one of those that pass is.
CREDIBLE = 0.95
#: Change of -2 ln p by which held-out data refute an effect, or confirm it: odds of one in twenty.
DECISIVE = 2 * np.log(20)


def compute_log_density(refit: Refit) -> float:
    """2 ln of the density of training and held-out data together, by its own covariance, up to a constant [-].

    Falls of chi^2 tell whether an effect is there. They do not rank two effects, each of which has a covariance of its
    own; densities do.
    """
    return refit.gain + refit.held_out_gain if refit.cost is None else -refit.cost


def compute_whole_gain(refit: Refit) -> float:
    """Fall of -2 ln p of all data by an effect, by the worse one of two covariances [-].

    Densities are by the covariance of the effect's own model alone, which few friction histories tell.
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
        Which of them no data of these tests can tell apart, shape (n, n); none by default. These are equally probable:
        their densities differ by where their fits ended and by the covariances of their models.
    weights
        2 ln of a density that an effect is weighed by; of several the mean of the probabilities counts, so that what
        they disagree on is not sure.
    """
    log_densities = [np.array([weigh(item) for item in refits], dtype=np.float64) for weigh in weights]
    return np.asarray(np.mean([_normalise(item, same) for item in log_densities], axis=0))


def _normalise(
    log_density: Float[NDArray[np.float64], " n"], same: Bool[NDArray[np.bool_], "n n"] | None
) -> Float[NDArray[np.float64], " n"]:
    """Probabilities of 2 ln of densities, shape (n,)."""
    if same is not None:
        log_density = np.where(same, log_density, -np.inf).max(axis=1, initial=-np.inf)
    weight = np.exp((log_density - log_density.max(initial=-np.inf)) / 2)
    return np.asarray(weight / weight.sum())


def compute_birge_ratio(refit: Refit, gain: float = 0.0) -> float:
    """Birge ratio, squared: reduced chi-squared that a fit leaves, or would beside a further gain, at least 1 [-].

    Gains scatter by as much more than the thresholds say: a covariance is an estimate as well, and what a good fit
    leaves beyond it, no effect explains (Birge, Phys. Rev. 40 (1932), 207-227).
    """
    return max((refit.fit.chi2 - gain) / refit.fit.n_number, 1.0)


def exceeds_threshold(refit: Refit, thresholds: Thresholds) -> bool:
    """Whether the training data gain more by an effect than chance does, whatever the held-out data say."""
    return refit.gain > thresholds.gain * compute_birge_ratio(refit)


def passes(refit: Refit, thresholds: Thresholds) -> bool:
    """Whether the training data gain more by an effect than chance does, and the held-out data do not refute it."""
    return bool(compute_evidence(refit) > thresholds.gain * compute_birge_ratio(refit))


def compute_evidence(refit: Refit) -> float:
    """Fall of -2 ln p of the training data, less what the held-out data lose; none if these refute the effect [-]."""
    return 0.0 if refit.worsens else discount_gain(refit.gain, refit.held_out_gain)


def discount_gain(gain: float, held_out_gain: float) -> float:
    """A fall of -2 ln p of the training data, less what the held-out data lose; none if these refute it [-]."""
    return 0.0 if held_out_gain <= -DECISIVE else gain + min(held_out_gain, 0.0)


def is_refuted(refit: Refit) -> bool:
    """Whether the held-out data speak against an effect."""
    return refit.worsens or refit.held_out_gain <= -DECISIVE


def errs_on_held_out(refit: Refit) -> bool:
    """Whether a large error of the held-out data is left that noise and stated errors do not explain."""
    return refit.held_out_error > LARGE_ERROR and refit.held_out_reduced_chi2_by_noise > UNEXPLAINED_CHI2
