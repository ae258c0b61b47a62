"""Effects that no data of these tests can tell apart, such as preload and gap of a contact that stays closed."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray

from diagnosis.decision.evidence import DECISIVE
from diagnosis.decision.stand_in import MAX_SHARE_LEFT
from diagnosis.fit.calibration import Vector
from diagnosis.fit.problem import Refit


def find_same(refits: Sequence[Refit], directions: Mapping[str, Vector]) -> Bool[NDArray[np.bool_], "n n"]:
    """Which effects no data of these tests can tell apart, shape (n, n).

    Parameters
    ----------
    refits
        Effects that pass.
    directions
        Change by each of them, calibration parameters projected out, by its name: a unit vector.
    """
    return np.array([[one is other or _is_same(one, other, directions) for other in refits] for one in refits])


def _is_same(one: Refit, other: Refit, directions: Mapping[str, Vector]) -> bool:
    """Whether two effects change the data alike, to odds of one in twenty, and gain alike.

    An effect gains less than another one by the share 1 - cos^2 at most, of which the cosine is that of their changes.
    Strong effects are not linear: what they gain may tell them apart.
    """
    if one.name not in directions or other.name not in directions:
        return False
    apart = 1 - float(directions[one.name] @ directions[other.name]) ** 2
    less, more = sorted(item.gain + item.held_out_gain for item in (one, other))
    return apart * more < DECISIVE and more - less < MAX_SHARE_LEFT * more
