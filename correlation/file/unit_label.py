"""Units as test programs label them, and as `correlation.campaign.measurement_unit` reads them.

Only units of test benches are taken: the library of units knows so many that "acc" is an attocubic centimetre.
"""

import re
from functools import cache

#: A label with its unit: "acc [m/s^2]", "force (N)", "x / mm" is not taken: it may be a ratio.
BRACKETED = re.compile(r"^(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*(?:\([^()]*\)[^()]*)*)\))\s*$")
#: Words that programs write for a unit, in small letters, as this project writes it.
ALIASES = {
    "g": "g_n", "gn": "g_n", "g0": "g_n", "g's": "g_n", "gs": "g_n", "g_n": "g_n", "g rms": "g_n", "g pk": "g_n",
    "newton": "N", "newtons": "N", "lb": "lbf", "lbs": "lbf", "lbf": "lbf", "pound": "lbf", "pounds": "lbf",
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "sek": "s", "msec": "ms",
    "hertz": "Hz", "hz": "Hz", "khz": "kHz", "1/s": "Hz", "rpm": "rpm", "1/min": "rpm", "u/min": "rpm",
    "volt": "V", "volts": "V", "v": "V", "mv": "mV", "meter": "m", "metre": "m", "meters": "m", "in": "inch",
    "inches": "inch", "micron": "um", "microns": "um", "deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg",
    "radian": "rad", "radians": "rad", "rad": "rad", "%": "percent", "ips": "inch/s",
}  # fmt: skip
#: Labels that name no unit.
NO_UNIT = {"", "-", "none", "null", "1", "n/a", "na", "unitless", "dimensionless", "lin", "db", "eu", "unknown"}
#: Units of test benches, of which others are made by products, ratios and powers.
FAMILIAR = {
    "m", "mm", "um", "µm", "nm", "cm", "km", "inch", "ft", "mil", "N", "mN", "cN", "kN", "MN", "lbf", "kgf", "poundal",
    "Pa", "kPa", "MPa", "GPa", "bar", "psi", "kg", "mg", "lb", "tonne", "s", "ms", "us", "µs", "min", "Hz", "kHz",
    "MHz", "rpm", "rad", "mrad", "deg", "percent", "J", "W", "g_n", "V", "mV", "uV", "µV", "kV", "A", "mA", "K", "degC",
}  # fmt: skip
CHARACTERS = str.maketrans({"²": "^2", "³": "^3", "·": "*", "μ": "µ", "⋅": "*"})


def split_label(label: str) -> tuple[str, str]:
    """Name and unit of a label such as "acc [m/s^2]" or "force (N)"; the unit is empty if none is in brackets.

    Returns
    -------
    Name without the unit, and the unit as `unit_text` gives it. A bracket that is no unit stays in the name.
    """
    match = BRACKETED.match(label)
    if match is None or not match[1]:
        return label.strip(), ""
    unit = unit_text(match[2] if match[2] is not None else match[3], name=match[1])
    return (match[1], unit) if unit else (label.strip(), "")


def unit_text(label: str, *, name: str = "") -> str:
    """Unit of a label as text for `measurement_unit`.

    Parameters
    ----------
    label
        What the program wrote: "m/s²", "g", "sec", "(m/s2)/N", "[um]".
    name
        Name of the quantity: "g" is the acceleration of gravity, except of a mass.

    Returns
    -------
    Text such as "m/s^2" or "g_n"; empty if the label names no unit.
    """
    text = label.strip().strip("[]").strip()
    if text.startswith("(") and text.find(")") == len(text) - 1:
        text = text[1:-1].strip()
    if text.lower() in NO_UNIT:
        return ""
    if text == "g" and re.search("mass|weight", name, re.IGNORECASE):
        return "g"
    return _normal(text)


@cache
def _normal(text: str) -> str:
    known = text if text in FAMILIAR else ALIASES.get(text.lower())
    if known:
        return known
    text = text.translate(CHARACTERS).replace("**", "^")
    text = re.sub(r"(?<=[A-Za-z])([23])(?![\d.])", r"^\1", text)  # m/s2
    parts = re.split(r"(\s*[/*^()]\s*|(?<=\^)-?\d(?!\d)|\s+)", text)
    units = [part if part in FAMILIAR else ALIASES.get(part.lower(), "") for part in parts[::2]]
    if len(parts) == 1 or any(not unit for unit, part in zip(units, parts[::2], strict=True) if part):
        return ""
    signs = [part.strip() or "*" for part in parts[1::2]]
    joined = "".join(unit + sign for unit, sign in zip(units, [*signs, ""], strict=True))
    return joined if joined.count("(") == joined.count(")") else ""
