"""Unit in which a quantity is drawn, so that its largest value is a handy number."""

#: Units for drawing motions and forces, with their factors, from the largest unit.
SCALED = {
    "m": (("m", 1.0), ("mm", 1e3), ("um", 1e6), ("nm", 1e9)),
    "m/s": (("m/s", 1.0), ("mm/s", 1e3), ("um/s", 1e6)),
    "m/s^2": (("m/s^2", 1.0), ("mm/s^2", 1e3)),
    "N": (("N", 1.0), ("mN", 1e3)),
}
#: The largest value drawn is at least this many units.
MIN_DRAWN = 0.3


def format_per_level_unit(unit: str, level_unit: str) -> str:
    """Unit of a quantity over the level, such as "um/N" or "mm/(m/s^2)"."""
    return f"{unit}/{level_unit}" if "/" not in level_unit else f"{unit}/({level_unit})"


def choose_unit(unit: str, largest: float) -> tuple[str, float]:
    """Unit for drawing values, and the factor that converts to it.

    Parameters
    ----------
    unit
        Unit of the values. Angles and uncalibrated readings keep it.
    largest
        Largest modulus of the values [unit].
    """
    units = SCALED.get(unit, ((unit, 1.0),))
    return next((item for item in units if largest * item[1] >= MIN_DRAWN), units[-1])
