"""Quantities of test benches: their units, and their words in the names of columns."""

import re

#: Units by quantity.
QUANTITIES = {
    "displacement": ("m", "mm", "um", "µm", "nm", "cm", "inch", "ft", "thou"),
    "velocity": ("m/s", "mm/s", "cm/s", "um/s", "µm/s", "inch/s", "ft/s"),
    "acceleration": ("m/s^2", "mm/s^2", "cm/s^2", "g_n", "ft/s^2", "inch/s^2", "m/s/s", "m*s^-2"),
    "force": ("N", "mN", "kN", "MN", "uN", "µN", "lbf", "kgf", "cN"),
    "voltage": ("V", "mV", "uV", "µV", "kV"),
    "angle": ("deg", "rad", "mrad"),
    "frequency": ("Hz", "kHz", "mHz", "rpm", "rad/s"),
    "time": ("s", "ms", "us", "µs", "ns", "min"),
}
OF_UNIT = {unit: quantity for quantity, units in QUANTITIES.items() for unit in units}
MOTION_WORDS = {
    "displacement": frozenset(
        ["displacement", "disp", "position", "pos", "laser", "x", "y", "z", "weg", "stroke", "u"]
    ),
    "velocity": frozenset(["velocity", "vel", "v", "speed"]),
    "acceleration": frozenset(["acceleration", "acc", "accel", "accelerometer", "a", "beschleunigung", "beschl"]),
}
#: Words of a measured force; "drive", "shaker" or "hammer" may also be the place of a measured motion.
FORCE_QUANTITY = frozenset(["force", "kraft", "load"])
#: Words by quantity; those of a force include all words of an excitation.
NAMED = {
    **MOTION_WORDS,
    "force": FORCE_QUANTITY | {"f", "hammer", "shaker", "drive", "excitation", "impact", "input", "level"},
    "frequency": frozenset(["frequency", "freq", "frequenz", "f"]),
    "time": frozenset(["time", "zeit", "t"]),
    "angle": frozenset(["phase", "phi", "angle"]),
}
#: Quantities that may be recorded as a voltage.
READ_IN_VOLTS = frozenset([*MOTION_WORDS, "force"])


def find_named_quantities(name: str) -> set[str]:
    """Quantities that the words of a name suggest."""
    words = set(re.findall(r"[^\W\d_]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()))
    return {quantity for quantity, family in NAMED.items() if words & family}


def fits_name(name: str, unit: str) -> bool | None:
    """Whether a unit is of the quantity in a name, or a voltage that may represent it.

    Parameters
    ----------
    name
        Name of a column without its unit.
    unit
        Unit as `read_unit` gives it.

    Returns
    -------
    None if the name has no word of a quantity.
    """
    named = find_named_quantities(name)
    if not named:
        return None
    quantity = OF_UNIT.get(unit, "")
    return quantity in named or (quantity == "voltage" and bool(named & READ_IN_VOLTS))
