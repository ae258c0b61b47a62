"""Whether an effect stands in for something else: what is left beside it, another effect or an unknown force explains.

If another effect or an unknown force explains a good part of what is left, the effect alone is not the cause. The same
holds for a linear effect that leaves an unknown force which is no known effect: a force that varies with the amplitude
has a linear part, and what takes up this part may gain a great deal. An effect that varies with the amplitude as well
is the known one that is nearest.

What explains the rest of the training data, and is refuted by held-out data that the effect alone explains, is no
cause: it fits the errors of the model in these training data.
"""

from diagnosis.candidate.effect import changes_joints
from diagnosis.decision.evidence import is_refuted
from diagnosis.decision.fits import Fits
from diagnosis.decision.residual_explanation import ResidualExplanation
from diagnosis.fit.problem import UNEXPLAINED_CHI2, Refit
from diagnosis.unknown_force import compute_excess_gain

#: Share of the gain of an effect that others may gain beyond the threshold, and of the error that it may leave.
#: Set on development seeds [-].
MAX_SHARE_LEFT = 0.15
#: Share of the gain of an unknown force beside the best effect from which on a known one explains it, to first order as
#: well: it is then the next effect to be named. Set on development seeds [-].
MIN_SHARE_KNOWN = 0.5


def find_cause_beside(fits: Fits, refit: Refit) -> ResidualExplanation | None:
    """What explains what an effect leaves, if that is so much that it stands in for something else; else None."""
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
    # Without the effect, model error of the size of the responses may explain as much as it does, and gains are small.
    was, left = fits.baseline.reduced_chi2_by_noise, refit.reduced_chi2_by_noise
    explains_nearly_all = _leaves_little(was, left, MAX_SHARE_LEFT**2)
    return residual if beyond > MAX_SHARE_LEFT * refit.gain and not explains_nearly_all else None


def _leaves_little(was: float, left: float, share: float) -> bool:
    """Whether little is left of an error that noise and stated errors do not explain.

    Parameters
    ----------
    was, left
        Reduced chi-squared by noise and stated errors without an effect and with it [-].
    share
        Largest share of what the effect explains that may be left above 1 [-].
    """
    return was > UNEXPLAINED_CHI2 and left - 1 < share * (was - left)
