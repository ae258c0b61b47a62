"""Order of the levels of a test: sliders stay where earlier levels dragged them until the next set-up."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign

#: Relative difference below which levels are equal, due to rounding in files [-].
SAME_LEVEL = 1e-6


def find_earlier_levels(campaign: Campaign, levels: Sequence[float]) -> Bool[NDArray[np.bool_], "l l"]:
    """Whether in a repeat of a test a level (row) was preceded by another one (column); true for the level itself.

    Parameters
    ----------
    campaign
        Campaign; a repeat begins with the static load, without previous vibration. If readings have the same position
        in the order of runs, each of them may have been first.
    levels
        Levels of jointed tests, shape (l,).
    """
    table = campaign.measurement
    jointed = ~campaign.is_free
    table = table.where(jointed[table.test]) if len(table) else table
    result = np.eye(len(levels), dtype=bool)
    own = np.isclose(table.level, np.array(levels)[:, None], rtol=SAME_LEVEL, atol=0.0)
    for test, repeat in set(zip(table.test.tolist(), table.repeat.tolist(), strict=True)):
        rows = [table.order[at & (table.test == test) & (table.repeat == repeat)] for at in own]
        for later, earlier in np.ndindex(result.shape):
            if len(rows[later]) and len(rows[earlier]):
                result[later, earlier] |= bool(rows[earlier].min() <= rows[later].max())
    return result
