"""Whether an effect stands in for the true cause: another effect or an unknown force explains its residual.

If another effect or an unknown force explains a large part of the residual, the effect alone is not the cause. The same
is true for a linear effect whose residual shows an unknown force that no known effect explains: an amplitude-dependent
force has a linear part, and an effect that takes up this part may gain much. An effect that depends on the amplitude
itself is accepted as the nearest known effect.

An explanation of the training residual is rejected if held-out data refute it and the effect alone explains these: it
fits the model errors in the training data.
"""

from diagnosis.candidate.effect import changes_joints
from diagnosis.decision.evidence import is_refuted
from diagnosis.decision.fits import Fits
from diagnosis.decision.residual_explanation import ResidualExplanation
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.unknown_force import compute_excess_gain

#: Share of the gain of an effect that others may gain beyond the threshold, and share of the error that may remain.
#: Set on development seeds [-].
MAX_SHARE_LEFT = 0.15
#: Share of the gain of an unknown force beside the best effect, both to first order, from which a known effect explains
#: the force: that effect is then the next one to be named. Set on development seeds [-].
MIN_SHARE_KNOWN = 0.5


def find_cause_beside(fits: Fits, refit: Refit) -> ResidualExplanation | None:
    """Explanation of the residual after an effect, if large enough that the effect is a stand-in; else None."""
    residual, thresholds = fits.explain_residual(refit), fits.thresholds
    force = residual.places[0] if residual.places else None
    unknown = 0.0 if force is None else compute_excess_gain(force) - thresholds.misfit
    is_known = force is None or residual.known_effect_gain >= MIN_SHARE_KNOWN * force.gain
    assert refit.effect is not None
    is_linear = not changes_joints(refit.effect, fits.arrangement_of(refit).fit.model)
    was, left = fits.baseline.held_out_reduced_chi2_by_noise, refit.held_out_reduced_chi2_by_noise
    explains_held_out = _leaves_little(was, left, MAX_SHARE_LEFT)
    if is_known and explains_held_out and residual.refit and is_refuted(residual.refit):
        return None
    if unknown > 0 and not is_known and refit.reduced_chi2_by_noise > UNEXPLAINED_CHI2 and is_linear:
        return residual
    beyond = max(residual.gain - thresholds.gain, unknown)
    # Gains are small if, without the effect, a model error as large as the responses explains as much as the effect.
    was, left = fits.baseline.reduced_chi2_by_noise, refit.reduced_chi2_by_noise
    explains_nearly_all = _leaves_little(was, left, MAX_SHARE_LEFT**2)
    return residual if beyond > MAX_SHARE_LEFT * refit.gain and not explains_nearly_all else None


def _leaves_little(was: float, left: float, share: float) -> bool:
    """Whether an effect removes nearly all of an error that noise and stated errors do not explain.

    Parameters
    ----------
    was, left
        Reduced chi-squared by noise and stated errors without an effect and with it [-].
    share
        Largest excess over 1 that may remain, as a share of the fall by the effect [-].
    """
    return was > UNEXPLAINED_CHI2 and left - 1 < share * (was - left)
