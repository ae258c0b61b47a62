"""Clipping of the first crests of a free decay: too few samples to be detected among those of a whole record."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.signal.contamination import CREST

Samples = Float[NDArray[np.float64], " n"]

#: Least number of flat crests, with two samples or more each, of a clipped signal [-]: a structure that is held before
#: its release has one. Of 20,000 random decays read by converters of 5 to 15 bits, 0.07 % look clipped; of those cut
#: off at 95, 80 and 60 % of their largest value, 33, 78 and 95 % are found.
FEWEST_CRESTS = 2
#: Two crests are separate if the signal falls below this fraction of them in between [-].
BETWEEN = 0.5


def describe_clipping(values: Samples) -> str:
    """Words for the clipped side or sides of a decay, with the number of samples; empty without clipping.

    Parameters
    ----------
    values
        Signal, shape (n,) [any unit].
    """
    if len(values) < 2 or not np.ptp(values) > 0:
        return ""
    middle = float(np.median(values))
    ends = [("upper", values - middle), ("lower", middle - values)]
    low, high = float(values.min()), float(values.max())
    if np.isclose(high, -low, rtol=1e-9):
        ends.append(("upper and lower", np.abs(values)))
    for name, size in reversed(ends):
        if count := _count_flat(size):
            at = " and ".join(f"{value:.6g}" for value in {"upper": [high], "lower": [low]}.get(name, [high, low]))
            return f"{count} samples of its first periods are at the {name} end, {at}, exactly: the signal is clipped"
    return ""


def _count_flat(size: Samples) -> int:
    """Number of samples at the largest value of several crests, if smooth crests would have fewer; else 0."""
    value, count = np.unique(size, return_counts=True)
    if len(value) < 4 or count[-1] <= CREST * count[-3:-1].max():
        return 0
    at = size == value[-1]
    # Every crest is a stretch above the middle; its number is that of the falls before it.
    above = size > BETWEEN * value[-1]
    crest = np.cumsum(np.diff(above, prepend=False) & ~above)
    pairs = at[1:] & at[:-1]
    return int(at.sum()) if len(np.unique(crest[1:][pairs])) >= FEWEST_CRESTS else 0
