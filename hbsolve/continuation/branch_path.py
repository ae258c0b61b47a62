"""The path of a finished branch: over frequency, where the level may follow a power of it, or over the level."""

import numpy as np

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.branch import ResponseBranch
from hbsolve.continuation.continuation_parameter import FrequencyPath, LevelPath, Path
from hbsolve.errors import BalanceError
from reduction.array_type import Real

#: Powers of Omega that a level may follow, and its relative difference from one that is round-off.
LEVEL_POWERS, SAME_LEVEL = (1, 2), 1e-9


def make_path(balance: HarmonicBalance, branch: ResponseBranch) -> tuple[Path, Real]:
    """The path of a branch, and the value of lambda at each point."""
    frequency, level = branch.angular_frequency, branch.level
    if not len(frequency):
        raise BalanceError("the branch has no point")
    if len(level) > 1 and np.ptp(level) == 0 and np.ptp(frequency) == 0:
        raise BalanceError("neither frequency nor level changes along the branch: a joint's parameter cannot")
    grown = _find_level_power(frequency, level)
    if grown is not None:
        scale = float(level[0] / frequency[0] ** grown)
        return FrequencyPath(balance=balance.at_level(scale), level_power=grown), frequency
    if np.ptp(level) == 0:
        return FrequencyPath(balance=balance.at_level(float(level[0]))), frequency
    if np.ptp(frequency) == 0:
        return LevelPath(balance=balance, angular_frequency=float(frequency[0])), level
    raise BalanceError(
        "both frequency and level change along the branch: give a branch along which only one of them changes"
    )


def _find_level_power(frequency: Real, level: Real) -> int | None:
    """Power p if the level of a branch varies with Omega^p, as along a `FrequencyPath`; None for any other level."""
    if np.ptp(frequency) == 0 or np.ptp(level) == 0:
        return None
    for power in LEVEL_POWERS:
        if np.allclose(level, level[0] * (frequency / frequency[0]) ** power, rtol=SAME_LEVEL, atol=0):
            return power
    return None
