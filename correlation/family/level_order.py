"""Which levels a test had before others: what they drag stays until the structure is set up anew."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign

#: Levels that differ by less are one: files round them [-].
SAME_LEVEL = 1e-6


def find_earlier_levels(campaign: Campaign, levels: Sequence[float]) -> Bool[NDArray[np.bool_], "l l"]:
    """Whether a repeat of a test came to a level (row) by way of another (column), or that level itself.

    Parameters
    ----------
    campaign
        A repeat begins with the static load, which nothing has vibrated before. Readings of the same place in the order
        of the runs may each have been the first.
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
