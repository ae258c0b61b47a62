"""What chance may do: the gain and the misfit that a diagnosis must exceed before it claims anything."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Limits:
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
