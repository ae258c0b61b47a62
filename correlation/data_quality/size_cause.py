"""Likely causes of a factor on a response: a unit of length or force, g, or another kind of amplitude."""

from collections.abc import Set

import numpy as np

from correlation.data_quality.constant_factor import AMPLITUDES, UNITS
from correlation.data_quality.wrong_unit import LEVEL_UNITS, name_length

#: Pound-force [N].
POUND = 4.4482216
#: Tolerance for a known factor, or its scatter if larger [natural logarithm].
FACTOR_TOLERANCE = 0.05


def list_causes(logarithm: float, scatter: float, quantities: Set[str]) -> str:
    """Questions to the user about responses that are too large by some factor, with the remedy.

    Parameters
    ----------
    logarithm, scatter
        Natural logarithm of measured over expected, and its scatter [-].
    quantities
        Quantities of the affected sensors.
    """
    close = max(FACTOR_TOLERANCE, scatter)

    def is_near(factor: float) -> bool:
        return bool(abs(logarithm - np.log(factor)) < close)

    causes = [name_length(power, quantities) for power in (-9, -6, -3, 3, 6, 9) if is_near(10.0**power)]
    units = {pair: factor for quantity in sorted(quantities & UNITS.keys()) for factor, pair in UNITS[quantity].items()}
    causes += [
        f"are its values in {own} and read as {read}" for (own, read), factor in units.items() if is_near(factor)
    ]
    forces = {10.0**power: unit for power, unit in LEVEL_UNITS["N"].items()} | {POUND: "lbf"}
    causes += [f"is the force in {unit} and read as N" for factor, unit in forces.items() if is_near(factor)]
    causes += [
        f"is the response {own} and the force {read}" for factor, (own, read) in AMPLITUDES.items() if is_near(factor)
    ]
    known = "; or ".join(cause for cause in causes if cause) or "is a sensitivity or a gain wrong"
    return f"{known}? If so, correct the unit or the column; if not, the load or all masses and springs of the case"
