"""States at which repeats are on different branches: the response jumps, and not in all of them at one frequency."""

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray

from correlation.campaign.measurement import SAME_FREQUENCY, Campaign, Suspicion
from correlation.feature.branch import Branches, find_branches
from correlation.prediction import Points


def find_jumps(campaign: Campaign, points: Points) -> Bool[NDArray[np.bool_], " k"]:
    """Rows of states of which no reading can be used, shape (k,).

    Parameters
    ----------
    campaign
        Campaign with its single readings.
    points
        Rows of the same campaign.
    """
    lost = np.zeros(len(points), dtype=bool)
    for of in find_branches(campaign):
        for frequency in of.curves.frequency[of.lost]:
            near = np.abs(points.frequency / frequency - 1) < SAME_FREQUENCY
            lost |= (points.free == of.curves.free) & (points.level == of.curves.level) & near
    return lost


def find_jump_suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """One for each state that is left out, or of which some repeats are."""
    return tuple(
        Suspicion(where=_where(of, float(of.curves.frequency[state])), sentence=_sentence(of, int(state)))
        for of in find_branches(campaign)
        for state in np.flatnonzero(of.out.any(axis=0))
    )


def _where(of: Branches, frequency: float) -> str:
    return f"{'free' if of.curves.free else 'jointed'} test, {of.curves.level:g} N, {frequency:g} Hz"


def _sentence(of: Branches, state: int) -> str:
    if of.lost[state]:
        return (
            "repeats scatter far more than at the frequencies beside it: the response jumps between two steady "
            "states; the point is left out of every fit"
        )
    repeats = ", ".join(str(number) for number in np.unique(of.curves.repeat[of.out[:, state]]))
    return (
        f"repeat {repeats} is on another branch than the others: it jumped at another frequency, and is left out here"
    )
