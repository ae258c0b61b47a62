"""Root units of the most common units without pint, which takes half a second to import and to set up."""

import re
from decimal import Decimal

#: Factor to root units, and exponents of gram, meter, radian and second, by the symbol of the unit.
SYMBOLS: dict[str, tuple[str, tuple[int, int, int, int]]] = {
    "m": ("1", (0, 1, 0, 0)), "mm": ("1e-3", (0, 1, 0, 0)), "um": ("1e-6", (0, 1, 0, 0)), "µm": ("1e-6", (0, 1, 0, 0)),
    "kg": ("1e3", (1, 0, 0, 0)), "g": ("1", (1, 0, 0, 0)), "s": ("1", (0, 0, 0, 1)), "ms": ("1e-3", (0, 0, 0, 1)),
    "N": ("1e3", (1, 1, 0, -2)), "kN": ("1e6", (1, 1, 0, -2)), "Pa": ("1e3", (1, -1, 0, -2)),
    "MPa": ("1e9", (1, -1, 0, -2)), "GPa": ("1e12", (1, -1, 0, -2)), "Hz": ("1", (0, 0, 0, -1)),
    "kHz": ("1e3", (0, 0, 0, -1)), "rad": ("1", (0, 0, 1, 0)), "percent": ("0.01", (0, 0, 0, 0)),
    "%": ("0.01", (0, 0, 0, 0)),
}  # fmt: skip
ROOTS = ("gram", "meter", "radian", "second")
#: One symbol with the operator before it and its exponent.
FACTOR = re.compile(r"(^|(?<!^)[*/ ])([^\W\d_]+|%)(?:\^([1-9]))?")


def find_familiar_root_units(unit: str) -> tuple[Decimal, tuple[tuple[str, float], ...]] | None:
    """Factor to root units, and the root units as sorted (name, exponent) pairs; None if pint has to read the unit."""
    factors = list(FACTOR.finditer(unit))
    # A product after a slash is ambiguous: a/b*c.
    slashes = [match[1] == "/" for match in factors]
    if "".join(match[0] for match in factors) != unit or slashes != sorted(slashes):
        return None
    factor, exponents = Decimal(1), [0, 0, 0, 0]
    for match, below in zip(factors, slashes, strict=True):
        if match[2] not in SYMBOLS:
            return None
        size, own = SYMBOLS[match[2]]
        power = int(match[3] or 1) * (-1 if below else 1)
        factor *= Decimal(size) ** power
        exponents = [old + power * new for old, new in zip(exponents, own, strict=True)]
    return factor, tuple((root, float(power)) for root, power in zip(ROOTS, exponents, strict=True) if power)
