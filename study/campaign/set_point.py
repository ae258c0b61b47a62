"""Set points: columns whose value changes between passes, not within a pass over frequency or time."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Series = Float[NDArray[np.float64], " n"]

#: Largest relative difference of a controlled value from its set point [-].
HELD = 0.05


def changes_between_passes(values: Series, abscissa: Series) -> bool:
    """Whether most changes of a column are where its abscissa reverses, restarts or is constant.

    A force that drops near a resonance, or changes within a pass over time, is measured and not a set point.

    Parameters
    ----------
    values, abscissa
        Values of the column, and its frequency or time, in the order of measurement, shape (n,) each.
    """
    step = np.sign(np.diff(abscissa))
    on = step != 0
    on[1:] &= step[1:] == step[:-1]
    on[:-1] &= step[:-1] == step[1:]
    changes = np.diff(values) != 0
    return 2 * int((changes & on).sum()) < int(changes.sum())
