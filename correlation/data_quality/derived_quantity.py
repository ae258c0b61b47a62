r"""A motion with a wrong quantity, such as a displacement labelled as acceleration: a factor of a power of i omega.

An acceleration is :math:`-\omega^2` times its displacement, so that a wrong quantity alone looks like a reversed cable;
it is :math:`i \omega` times its velocity, which looks like a phase that does not refer to the force.
"""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.data_quality.wrong_unit import UNITS

#: Power of i omega of each quantity relative to a displacement.
POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}
#: Largest change of the size that a model error explains, so that the cable is reversed; another quantity changes it
#: more, and agrees with a power of ten within this tolerance [natural logarithm].
SIZE, UNIT = np.log(3.0), 0.3


def name_derived_quantity(
    stated: str, ratio: Complex[NDArray[np.complex128], " n"], frequency: Float[NDArray[np.float64], " n"]
) -> str:
    """Quantity of readings by their phase and size, such as "a displacement in um"; empty for the stated one.

    Parameters
    ----------
    stated
        Quantity of the sensor.
    ratio
        Readings over the predictions of the model, shape (n,) [-].
    frequency
        Frequency of each reading, shape (n,) [Hz].
    """
    there = np.isfinite(ratio) & (ratio != 0)
    if stated not in POWER or not there.any():
        return ""
    ratio, size = ratio[there], np.log(np.abs(ratio[there]))
    turns = round(float(np.angle((ratio / np.abs(ratio)).sum())) / (np.pi / 2))
    for other, of_other in POWER.items():
        power = of_other - POWER[stated]
        left = size - power * np.log(2 * np.pi * frequency[there])
        middle = float(np.median(left))
        ten = round(middle / np.log(10))
        unit = {0: "SI", **UNITS[other]}.get(ten)
        alike = not power or (turns - power) % 4 or abs(float(np.median(size))) < SIZE
        if unit is None or alike or abs(middle - ten * np.log(10)) > UNIT:
            continue
        # Over a narrow band omega changes little, but the power of it must not increase the scatter of the ratios.
        if np.std(left) <= np.std(size):
            return f"{'an' if other == 'acceleration' else 'a'} {other} in {unit}"
    return ""
