"""Effects that these tests cannot distinguish, such as preload and gap of a contact that stays closed."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool
from numpy.typing import NDArray

from diagnosis.decision.evidence import DECISIVE
from diagnosis.decision.stand_in import MAX_SHARE_LEFT
from diagnosis.fit.calibration import Vector
from diagnosis.fit.problem import Refit


def find_same(refits: Sequence[Refit], directions: Mapping[str, Vector]) -> Bool[NDArray[np.bool_], "n n"]:
    """Pairs of effects that these tests cannot distinguish, shape (n, n).

    Parameters
    ----------
    refits
        Effects that pass.
    directions
        Change of the data by each effect, calibration parameters projected out, by its name: a unit vector.
    """
    return np.array([[one is other or _is_same(one, other, directions) for other in refits] for one in refits])


def _is_same(one: Refit, other: Refit, directions: Mapping[str, Vector]) -> bool:
    """Whether two effects change the data in the same direction, to odds of 1 to 20, and have similar gains.

    To first order the gain of one effect is below that of the other by at most the share 1 - cos^2, with the angle
    between their changes. Strong effects are nonlinear and may differ in their gains nevertheless.
    """
    if one.name not in directions or other.name not in directions:
        return False
    apart = 1 - float(directions[one.name] @ directions[other.name]) ** 2
    less, more = sorted(item.gain + item.held_out_gain for item in (one, other))
    return apart * more < DECISIVE and more - less < MAX_SHARE_LEFT * more
