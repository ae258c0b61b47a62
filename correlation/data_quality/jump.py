"""States at which repeats are on different branches, because they jump at different frequencies."""

import numpy as np

from correlation.campaign.measurement import SWEEPS, Campaign, Suspicion, name_configuration
from correlation.feature.branch import Branches, find_branches

#: Causes of differences between repeats of one state.
CAUSES = "the response jumps between two steady states, contacts slip in some repeats only, or it had not settled"


def find_jump_suspicions(campaign: Campaign) -> tuple[Suspicion, ...]:
    """Remark on each state that is excluded in some or all repeats; a jump is not a mistake."""
    return tuple(
        Suspicion(
            where=_name_state(campaign, of, float(of.curves.frequency[state])),
            sentence=_describe_state(of, int(state)),
            remark=True,
        )
        for of in find_branches(campaign)
        for state in np.flatnonzero(of.excluded.any(axis=0))
    )


def _name_state(campaign: Campaign, branches: Branches, frequency: float) -> str:
    level = f"{branches.curves.level:g} {campaign.drive.unit}"
    return f"{name_configuration(branches.curves.free)} test, {level}, {frequency:g} Hz"


def _describe_state(branches: Branches, state: int) -> str:
    if branches.is_empty[state]:
        return (
            f"repeats scatter far more than at neighbouring frequencies: {CAUSES}; the point is left out of every fit"
        )
    curves, there = branches.curves, np.isfinite(branches.curves.value[:, state])
    ways_of: dict[tuple[tuple[int, ...], bool], list[str]] = {}
    for way in np.unique(curves.sweep[there]).tolist():
        own = there & (curves.sweep == way)
        excluded = own & branches.excluded[:, state]
        key = (tuple(np.unique(curves.repeat[excluded]).tolist()), bool((excluded == own).all()))
        ways_of.setdefault(key, []).append(SWEEPS[way])
    clauses = []
    for (repeats, whole), ways in ways_of.items():
        of_sweep = "" if len(ways_of) == 1 else f" of the sweep {' and '.join(ways)}"
        if whole:
            clauses.append(f"all repeats{of_sweep} scatter, and are left out here: {CAUSES}")
        elif repeats:
            they, are = ("it", "is") if len(repeats) == 1 else ("they", "are")
            clauses.append(
                f"{_name_repeats(repeats)}{of_sweep} {are} on another branch than most: {they} jumped at another "
                f"frequency and {are} left out here"
            )
    return "; ".join(clauses)


def _name_repeats(repeats: tuple[int, ...]) -> str:
    """Repeats in words, such as "repeats 1 to 5"."""
    first, last = repeats[0], repeats[-1]
    if len(repeats) == 1:
        return f"repeat {first}"
    if len(repeats) > 2 and last - first == len(repeats) - 1:
        return f"repeats {first} to {last}"
    return f"repeats {', '.join(map(str, repeats[:-1]))} and {last}"
