"""Detection thresholds: the gain and the misfit that a diagnosis must exceed before it claims anything."""

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.screening import Score
from diagnosis.threshold.null_gain import draw_null_gains, find_threshold

#: What the linear theory leaves out, by experience: refits gain more than it says.
MARGIN = 2.0
#: What an unknown force gains beyond its numbers where nothing is missing; of the order of the gains of effects.
UNKNOWN_FORCE = 1.5
#: ... and at least, however few effects there are to try: that of eight numbers at one of ten places, by chance.
LEAST_MISFIT = 18.0


@dataclass(frozen=True, kw_only=True)
class Thresholds:
    """Thresholds of one layout of tests, sensors and model.

    Parameters
    ----------
    gain
        Fall of chi^2 by the best effect that a share `false_alarms` of campaigns without any effect exceeds.
    misfit
        What an unknown force at one place gains beyond the numbers that it has, exceeded as seldom.
    false_alarms
        That share [-].
    n_trial
        Campaigns without any effect that told them; 0 if they come from the linear theory alone.
    """

    gain: float
    misfit: float
    false_alarms: float = 0.01
    n_trial: int = 0


#: Where the gains of chi^2 decide nothing.
NO_THRESHOLDS = Thresholds(gain=0.0, misfit=0.0)


def compute_linear_thresholds(scores: Sequence[Score], false_alarms: float = 0.01) -> Thresholds:
    """Thresholds for a layout without a bootstrap: those of the linear theory with a margin."""
    gain = MARGIN * find_threshold(draw_null_gains(scores), false_alarms)
    return Thresholds(gain=gain, misfit=max(UNKNOWN_FORCE * gain, LEAST_MISFIT), false_alarms=false_alarms)
