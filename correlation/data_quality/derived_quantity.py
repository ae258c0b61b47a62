r"""A displacement that is called an acceleration, or the other way round: the opposite sign and a factor of omega^2.

An acceleration is :math:`-\omega^2` times its displacement, so that a wrong name alone looks like a reversed cable.
"""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.data_quality.wrong_unit import UNITS

#: Another quantity by what is stated, and the power of omega that it brings.
OTHER = {"acceleration": ("displacement", -2), "displacement": ("acceleration", 2)}
#: A reversed cable leaves the size, which a model is off by up to so much; another quantity changes it further, and is
#: a unit of its own, a power of ten, within so much [natural logarithm].
SIZE, UNIT = np.log(3.0), 0.3


def name_derived_quantity(
    stated: str, ratio: Complex[NDArray[np.complex128], " n"], frequency: Float[NDArray[np.float64], " n"]
) -> str:
    """What readings of the opposite sign are, such as "a displacement in um"; empty where their size is the model's.

    Parameters
    ----------
    stated
        Quantity of the sensor.
    ratio
        Readings over what the model says, shape (n,) [-].
    frequency
        Of each, shape (n,) [Hz].
    """
    there = np.isfinite(ratio) & (ratio != 0)
    if stated not in OTHER or not there.any():
        return ""
    other, power = OTHER[stated]
    size = np.log(np.abs(ratio[there]))
    left = size - power * np.log(2 * np.pi * frequency[there])
    middle = float(np.median(left))
    ten = round(middle / np.log(10))
    unit = {0: "SI", **UNITS[other]}.get(ten)
    if unit is None or abs(float(np.median(size))) < SIZE or abs(middle - ten * np.log(10)) > UNIT:
        return ""
    # Over a narrow band omega^2 changes little, but it must not make the ratios less alike.
    return f"{'an' if other == 'acceleration' else 'a'} {other} in {unit}" if np.std(left) <= np.std(size) else ""
