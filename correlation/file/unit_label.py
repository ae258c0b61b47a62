"""Parsing of the labels of test programs to units for `correlation.campaign.measurement_unit`.

A label is a name with a unit: "acc [m/s^2]", "force (N)", "Weg / µm", "Weg in µm", "Displacement, um", "Disp um". A
unit is made of symbols or words by products, ratios and powers; a word such as "rms" beside it defines the kind of
amplitude. Only units of test benches are accepted: pint has so many that it reads "acc" as an attocubic centimetre.
"""

import re
from functools import cache
from typing import NamedTuple

from correlation.file.quantity import OF_UNIT, fits_name

#: Label with a unit in brackets, after which more words may follow.
BRACKETED = re.compile(
    r"^(?P<name>.*?)\s*(?P<both>\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*(?:\([^()]*\)[^()]*)*)\))"
    r"(?P<rest>(?!\s*[/*^·])[^\[\]()]*)$"
)
#: Sign between a name and a unit; a stroke without blanks may be part of a path or of a ratio.
BEFORE_UNIT = re.compile(r"(?<=[^\s/,])(?:\s+/\s+|/|\s+in\s+|,\s+)(?=\S)")
#: Unit followed by a word or by a quantity such as a level.
OF_CELL = re.compile(r"(?P<unit>.+?)\s+(?P<words>[^\W\d_]+|\(?(?:@|at|bei)?\s*\d[\d.,p]*\s?[^\W\d_]+\)?)")
LAST_WORD = re.compile(r"^(?P<name>.*\S)\s+(?P<unit>\S+)$")
#: Units that are also words of names.
WORDS_TOO = {"in", "min", "us", "ft"}
#: Unit by the words of programs for it, in lower case.
ALIASES = {
    "g": "g_n", "gn": "g_n", "g0": "g_n", "g's": "g_n", "gs": "g_n", "g_n": "g_n",
    "lb": "lbf", "lbs": "lbf", "lbf": "lbf", "pound": "lbf", "pounds": "lbf",
    "sec": "s", "secs": "s", "sek": "s", "msec": "ms", "hz": "Hz", "khz": "kHz", "1/s": "Hz", "rpm": "rpm",
    "1/min": "rpm", "u/min": "rpm", "v": "V", "mv": "mV", "mm": "mm", "um": "um", "cm": "cm", "kn": "kN", "in": "inch",
    "inches": "inch", "micron": "um", "microns": "um", "mil": "thou", "mils": "thou", "thou": "thou", "deg": "deg",
    "degree": "deg", "degrees": "deg", "grad": "deg", "°": "deg", "radian": "rad", "radians": "rad", "rad": "rad",
    "%": "percent", "ips": "inch/s", "zoll": "inch", "kp": "kgf", "gal": "cm/s^2",
    "ms-2": "m/s^2", "ms^-2": "m/s^2", "cps": "Hz", "cpm": "rpm",
}  # fmt: skip
#: Units as words, with the prefixes below: "Mikrometer", "milliseconds".
WRITTEN_OUT = re.compile(
    r"(?P<prefix>nano|mi[ck]ro|milli|[cz]enti|kilo|)"
    r"(?:(?P<m>met(?:er|re)[sn]?)|(?P<N>newtons?)|(?P<V>volts?)|(?P<s>seconds?|sekunden?)|(?P<Hz>hertz)|(?P<Pa>pascal))"
)
PREFIXES = {"nano": "n", "micro": "u", "mikro": "u", "milli": "m", "centi": "c", "zenti": "c", "kilo": "k", "": ""}
#: Labels that name no unit.
NO_UNIT = {"", "-", "none", "null", "1", "n/a", "na", "unitless", "dimensionless", "lin", "db", "eu", "unknown"}
#: Units of test benches, of which others are made by products, ratios and powers.
FAMILIAR = {
    *(prefix + symbol for prefix in ("", "n", "u", "µ", "m", "k") for symbol in ("m", "N", "s", "V", "A", "Hz", "Pa")),
    "cm", "inch", "ft", "cN", "MN", "lbf", "kgf", "poundal", "MPa", "GPa", "bar", "psi", "kg", "mg", "lb", "tonne",
    "min", "MHz", "rpm", "rad", "mrad", "deg", "percent", "J", "W", "g_n", "K", "degC",
}  # fmt: skip
#: Unit by the end of a name such as "force_N", in lower case; `SUFFIX` adds those of velocities and accelerations.
SUFFIXES = {
    "rad_s": "rad/s", "s": "s", "ms": "ms", "n": "N", "kn": "kN", "mn": "mN", "m": "m", "nm": "nm",
    **{unit: ALIASES[unit] for unit in ("hz", "khz", "rpm", "lbf", "mm", "um", "in", "v", "mv", "rad", "deg", "g")},
    "mils": "thou", "volt": "V", "volts": "V",
}  # fmt: skip
SUFFIX = re.compile(r"(?P<length>[umn]?m|in|ft)_?(?:p(?:er)?_?)?s(?P<power>_?2)?")
#: Replacement of signs with the same meaning; the Greek mu becomes the micro sign.
CHARACTERS = str.maketrans({
    "·": "*", "⋅": "*", "•": "*", "×": "*", "μ": "µ",
    **dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-", strict=True)),
})  # fmt: skip
SUPERSCRIPT = re.compile(r"(?=[⁰¹²³⁴-⁹⁻])(?<![⁰¹²³⁴-⁹⁻])")
#: Patterns of the kinds of amplitude, beside a unit or within a name.
AMPLITUDES = {
    "peak to peak": r"p(?:ea)?k?(?:\s*-\s*|\s+to\s+|\s+)?p(?:ea)?k?|ptp|spitze-spitze",
    "rms": r"rms|r\.m\.s\.?|eff(?:ektivwert)?",
    "peak": r"0\s*-?\s*p(?:ea)?k?|zero[- ](?:to[- ])?peak|pk|peak",
}
OF_AMPLITUDE = {word: re.compile(pattern, re.IGNORECASE) for word, pattern in AMPLITUDES.items()}
IN_WORDS = {
    word: re.compile(rf"(?<![A-Za-z0-9])(?:{pattern})(?![A-Za-z0-9])", re.IGNORECASE)
    for word, pattern in AMPLITUDES.items()
}
WITH_AMPLITUDE = re.compile(
    rf"^(?P<unit>.*?)[\s_,-]*[\[(]?(?P<word>{'|'.join(AMPLITUDES.values())})[\])]?$", re.IGNORECASE
)
#: Factor before a unit; "3 N" and "80 Hz" are levels and frequencies.
FACTOR = re.compile(r"(?P<times>[x×*]?)\s*\d[\d.,^eE+*×-]*\s*(?P<unit>.*)$")
SCALED = {"displacement", "velocity", "acceleration"}
NO_WORD = re.compile(r"[µμ²³⁻^%*\"]|\b[a-z]\.[a-z]\.")
#: Signs that occur only in units.
SIGNS = re.compile(r"[µμ°²³⁻^%]|\w\s*/\s*\(?\w|\d/\w")


class Label(NamedTuple):
    """Parts of a label: its name, its unit, known or unknown, and the sign before the unit.

    A unit is doubtful if its quantity is not that of the name: "acc / N" may be a ratio.
    """

    name: str
    unit: str = ""
    sign: str = ""
    is_doubtful: bool = False


def split_label(label: str) -> tuple[str, str]:
    """Name and unit of a label such as "acc [m/s^2]", "force (N)" or "Weg / µm"; the unit is empty if there is none.

    Returns
    -------
    Name without the unit, and the unit as `read_unit` gives it. Text that is not a unit remains in the name.
    """
    result = find_unit(label)
    unit = "" if result.is_doubtful else read_unit(result.unit, name=result.name)
    return (result.name, unit) if unit else (label.strip(), "")


def find_unit(label: str) -> Label:
    """Name of a label and the text at the place of its unit.

    Returns
    -------
    Parts of the label; the sign is "[", "(", "/", "in", "," or, before a last word, empty. Without a unit, the name is
    the whole label.
    """
    label = label.strip()
    if (match := WITH_AMPLITUDE.match(label)) and match["unit"]:  # "Force [N] rms"
        result = find_unit(match["unit"])
        if read_unit(result.unit, name=result.name) and not result.is_doubtful:
            return result._replace(unit=f"{result.unit} {match['word']}")
    if (match := BRACKETED.match(label)) and match["name"] and not read_unit(match["name"]):  # "(m/s^2)(N)"
        token = match["square"] if match["square"] is not None else match["round"]
        rest, sign = match["rest"].strip(), match["both"][0]
        if not read_unit(token) and read_unit((result := find_unit(match["name"])).unit) and not result.is_doubtful:
            return result._replace(name=f"{result.name} {match['both']} {rest}".strip())  # "Disp [mm] (tip)"
        if not rest or (read_unit(token) and (sign == "[" or _may_be_behind(match["name"], sign, token))):
            return Label(f"{match['name']} {rest}".strip(), token, sign)
    behind = [(label[: one.start()], one[0], label[one.end() :]) for one in BEFORE_UNIT.finditer(label)]
    known = next(((name, sign, unit) for name, sign, unit in behind if _may_be_behind(name, sign, unit)), None)
    if known is not None:
        return Label(known[0], known[2], known[1].strip())
    if (match := LAST_WORD.match(label)) and _may_be_last(match["name"], match["unit"]):
        return Label(match["name"], match["unit"])
    unknown = next(((name, sign, unit) for name, sign, unit in behind if sign != "/"), None)
    return Label(unknown[0], unknown[2], unknown[1].strip(), True) if unknown is not None else Label(label)


def _may_be_behind(name: str, sign: str, token: str) -> bool:
    """Whether a known unit follows a sign; after a stroke without blanks, it must be of the quantity in the name."""
    unit = read_unit(token, name=name)
    fits = fits_name(name, unit)
    return bool(unit) and _is_symbol(token) and (fits is True or (sign != "/" and (fits is None or len(unit) > 1)))


def _is_symbol(token: str) -> bool:
    """Whether a text is a symbol of a unit and not a letter that may be a name, such as that of an axis."""
    return len(token) > 1 or token in FAMILIAR or token in {"g", "G", "°", "%"}


def _may_be_last(name: str, token: str) -> bool:
    """Whether the last word is a unit: of the quantity in the name, or a symbol that is not a word."""
    unit = read_unit(token, name=name)
    if not unit:
        return looks_like_a_unit(token) and "/" not in token
    symbol = unit in OF_UNIT and len(token) > 1 and not token.isupper() and token.lower() not in WORDS_TOO
    fits = fits_name(name, unit) is True and _is_symbol(token) and token != "G"  # "acc F", "acc G" are channels
    return fits or symbol or bool(SIGNS.search(token))


def looks_like_a_unit(token: str) -> bool:
    """Whether a text that is not a known unit looks like a unit: "µinch", "mm/furlong", "0.1 mm", "x 1000"."""
    if match := FACTOR.match(token):
        return not match["unit"] if match["times"] else OF_UNIT.get(read_unit(match["unit"]), "force") in SCALED
    words = re.findall(r"[^\W\d_]+", token)
    known = any(_read_symbol(word) and word.lower() != "in" for word in words)
    return bool(NO_WORD.search(token)) or (len(words) > 1 and known and bool(SIGNS.search(token)))


def read_unit(label: str, *, name: str = "") -> str:
    """Unit of a label as text for `measurement_unit`.

    Parameters
    ----------
    label
        Label of the program: "m/s²", "g", "sec", "(m/s2)/N", "[um]", "mm p-p".
    name
        Name of the quantity: "g" is the acceleration of gravity, except for a mass.

    Returns
    -------
    Text such as "m/s^2" or "g_n"; empty if the label is not a unit.
    """
    text = _strip_brackets(label)
    if text == "g" and re.search("mass|weight", name, re.IGNORECASE):
        return "g"
    return _parse(text)[0]


def find_suffix(name: str) -> tuple[str, str]:
    """Unit at the end of a name such as "velocity_mm_s" or "disp_mm_pp", as in the name and as text; empty without one.

    Units in `SUFFIXES` and `SUFFIX` are always accepted, other units only if their quantity is that of the name.
    """
    parts = name.split("_")
    for size in range(min(4, len(parts) - 1), 0, -1):
        ending = "_".join(parts[-size:])
        if unit := _read_suffix(ending.lower()):
            return ending, unit
    if len(parts) > 1 and (unit := read_unit(parts[-1])) and fits_name("_".join(parts[:-1]), unit):
        return parts[-1], unit
    return "", ""


@cache
def _read_suffix(ending: str) -> str:
    if ending in SUFFIXES:
        return SUFFIXES[ending]
    if match := SUFFIX.fullmatch(ending):
        return f"{_read_symbol(match['length'])}/s{'^2' if match['power'] else ''}"
    match = WITH_AMPLITUDE.match(ending)
    return _read_suffix(match["unit"].rstrip("_")) if match and match["unit"] else ""


def split_unit_cell(cell: str, *, name: str = "") -> tuple[str, str]:
    """Words and unit of a cell in a row of units, "(m/s^2)/N Real" or "um @ 3 N"; most cells have no words."""
    if unit := read_unit(cell, name=name):
        return "", unit
    match = OF_CELL.fullmatch(cell)
    known = read_unit(match["unit"], name=name) if match else ""
    return (match["words"], known) if match and known else ("", "")


def names_no_unit(label: str) -> bool:
    """Whether a label states that there is no unit, or one without meaning: "-", "none", "EU"."""
    return _strip_brackets(label).lower() in NO_UNIT


def find_amplitude_of_unit(label: str) -> str:
    """Kind of amplitude of a unit such as "mm p-p": "peak", "rms", "peak to peak"; empty if not stated."""
    return _parse(_strip_brackets(label))[1]


def find_amplitude_in_words(text: str) -> str:
    """Kind of amplitude by a word such as "RMS" in a text; empty without such a word or with several."""
    kinds = {meant for meant, pattern in IN_WORDS.items() if pattern.search(text)}
    if "peak to peak" in kinds:
        kinds -= {"peak"}
    return kinds.pop() if len(kinds) == 1 else ""


def _strip_brackets(label: str) -> str:
    text = label.strip().strip("[]").strip()
    return text[1:-1].strip() if text.startswith("(") and text.find(")") == len(text) - 1 else text


@cache
def _parse(text: str) -> tuple[str, str]:
    """Unit and kind of amplitude; both are empty if the text is not a unit."""
    if text.lower() in NO_UNIT:
        return "", ""
    if unit := _read_product(text):
        return unit, ""
    match = WITH_AMPLITUDE.match(text)
    if match is None or not match["unit"]:
        return "", ""
    kind = next(word for word, pattern in OF_AMPLITUDE.items() if pattern.fullmatch(match["word"]))
    above, stroke, below = match["unit"].rpartition("/")
    if stroke and (both := WITH_AMPLITUDE.match(above.strip("( "))) and both["word"].lower() == match["word"].lower():
        unit = _read_product(f"({both['unit'].strip()})/{below.strip('( ')}")
        return unit, ""  # the kind of amplitude cancels in a ratio
    unit = (
        "" if stroke and _read_product(below) in {"N", "mN", "kN", "lbf", "V"} else _read_product(match["unit"].strip())
    )
    return (unit, kind) if unit else ("", "")


def _read_symbol(text: str) -> str:
    """One unit without powers; empty if the text is not a unit."""
    known = text if text in FAMILIAR else ALIASES.get(text.lower(), "")
    if known or not (match := WRITTEN_OUT.fullmatch(text.lower())):
        return known
    prefix, symbol = PREFIXES[match["prefix"]], match.lastgroup or ""
    return prefix + symbol


def _read_product(text: str) -> str:
    """Product of units with powers; empty if one of them is unknown."""
    text = SUPERSCRIPT.sub("^", text).translate(CHARACTERS).replace("**", "^")
    if known := _read_symbol(text):
        return known
    text = re.sub(r"(?<=[A-Za-z])\.(?=[A-Za-z])", "*", text)  # m.s-2
    text = re.sub(r"(?<=[A-Za-z])(-?[23])(?![\d.])", r"^\1", text)  # m/s2
    text, of_one = re.subn(r"^1(?=\s*/)", "", re.sub(r"\bN ?s\b(?!\^)", "(N*s)", text))  # 1/kg, m/Ns
    if re.search(r"[^\W\d_]\s*\(", text):  # a name before a bracket
        return ""
    parts = re.split(r"(\s*[/*^()]\s*|(?<=\^)-?\d(?!\d)|\s+)", text)
    units = [_read_symbol(part) for part in parts[::2]]
    if len(parts) == 1 or any(not unit for unit, part in zip(units, parts[::2], strict=True) if part):
        return ""
    signs = [part.strip() or "*" for part in parts[1::2]]
    if signs[0] == "/" and not parts[0] and not of_one:
        return ""
    joined = "1" * of_one + "".join(unit + sign for unit, sign in zip(units, [*signs, ""], strict=True))
    return joined if joined.count("(") == joined.count(")") else ""
