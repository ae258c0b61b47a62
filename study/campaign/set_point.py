"""Set points: columns whose value changes only between passes, not while the frequency or the time goes on."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Series = Float[NDArray[np.float64], " n"]

#: A control holds its set point within this share [-].
HELD = 0.05


def changes_between_passes(values: Series, abscissa: Series) -> bool:
    """Whether most changes of a column lie where its abscissa turns, begins anew or stands.

    A force that drops near a resonance, or that steps while the time goes on, was measured; it is no set point.

    Parameters
    ----------
    values, abscissa
        The column, and its frequency or time, in the order of measurement, shape (n,) each.
    """
    step = np.sign(np.diff(abscissa))
    on = step != 0
    on[1:] &= step[1:] == step[:-1]
    on[:-1] &= step[:-1] == step[1:]
    changes = np.diff(values) != 0
    return 2 * int((changes & on).sum()) < int(changes.sum())
