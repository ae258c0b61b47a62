"""Level, frequency, repeat, direction of sweep and configuration of a run, from the names of files and groups."""

import re

from correlation.file.unit_label import find_unit

#: Words for a structure that was measured without its contacts.
FREE = {"free", "frei", "unjointed", "nocontact"}
#: Phrases for a structure with its contacts. They override "free", since every ring-down is a free decay.
WITH_CONTACTS = re.compile(r"\b(?:jointed|assembled|(?:with|mit) (?:joint|contact|kontakt))")
WITHOUT_CONTACTS = re.compile(rf"\b(?:(?:{'|'.join(sorted(FREE))})\b|(?:without|no|ohne) (?:joint|contact|kontakt))")
NUMBER = r"(?<![\d.])(\d+(?:[.,p]\d+)?)[ _]?"
#: Units of levels in names: of a force, a drive voltage, the acceleration of a base, or a drive in percent.
LEVEL_UNITS = {
    "N": ("N", 1.0), "newton": ("N", 1.0), "mN": ("N", 1e-3), "kN": ("N", 1e3), "V": ("V", 1.0), "volt": ("V", 1.0),
    "Vrms": ("V", 1.0), "Vpk": ("V", 1.0), "mV": ("V", 1e-3), "g": ("g_n", 1.0), "ms2": ("m/s^2", 1.0),
    "%": ("%", 1.0), "pct": ("%", 1.0),
}  # fmt: skip
LEVEL_IN_NAME = re.compile(rf"{NUMBER}({'|'.join(LEVEL_UNITS)})(?![a-zA-Z])")
#: Words before a force that is not a level, and before a level.
OTHER_FORCE = re.compile(r"(?:preload|pre-load|torque|clamp|normal|vorspann[a-z]*|vorlast)[ _=-]*$", re.IGNORECASE)
LEVEL_BEFORE = re.compile(r"(?:level|stufe|sweep|sine|drive)[ _=-]*$", re.IGNORECASE)
HARMONIC_IN_NAME = re.compile(
    r"(?<![A-Za-z])(?:H|harm(?:onic)?|order|ordnung)[ _]?(\d{1,2})(?:\.0+)?(?![\d.])", re.IGNORECASE
)
FREQUENCY_IN_NAME = re.compile(rf"{NUMBER}(k?)Hz(?![a-z])", re.IGNORECASE)
REPEAT_IN_NAME = re.compile(r"(?<![a-z])(?:rep|repeat|repetition|wiederholung)[ _-]?#?(\d+)", re.IGNORECASE)
RUN_IN_NAME = re.compile(
    r"(?<![A-Za-z])(?:run|lauf|messung|measurement|meas|trial|versuch|test|record)[ _-]?#?(\d+)", re.IGNORECASE
)
WAY = re.compile(r"(?<![a-z])(up|down)(?![a-z])[_ /-]?", re.IGNORECASE)
#: Words of a name that identify a run, its level, direction, time or configuration, and not a sensor.
RUN = "rep|repeat|run|lauf|test|trial|versuch|meas|measurement|messung|hit|impact|shot|schlag|decay|level|sweep"
WHEN = "day|tag|before|after|vorher|nachher|up|down|forward|backward|auf|ab"
CONFIGURATION = "|".join([*sorted(FREE), "jointed"])
OF_A_RUN = re.compile(rf"({RUN}|{WHEN}|{CONFIGURATION})?\d*|\d+k?Hz", re.IGNORECASE)
#: Words that accompany the level or number of a run.
BESIDE = {"level", "rep", "repeat", "repetition"}


def find_levels_in_name(name: str) -> list[re.Match[str]]:
    """Levels in a name, first those after a word such as "level"; "preload_10N" is not a level."""
    result = [one for one in LEVEL_IN_NAME.finditer(name) if not OTHER_FORCE.search(name[: one.start()])]
    return sorted(result, key=lambda one: LEVEL_BEFORE.search(name[: one.start()]) is None)


def read_level(match: re.Match[str]) -> tuple[float, str]:
    """Level of a match of `LEVEL_IN_NAME`, and its unit: N, V, g_n, m/s^2 or %."""
    unit, factor = LEVEL_UNITS[match[2]]
    return factor * decimal(match[1]), unit


#: Patterns that distinguish columns of several runs in one table. A level has no underscore before its unit ("acc_1_V"
#: is channel 1 in volts), and a number after "re" is a decibel reference.
OF_A_LEVEL = r"(?<![A-Za-z\d.])(?<!re )(?<!re\. )(?<!rel )(?<!rel\. )\d+(?:[.,p]\d+)?"
UNIT_OF_LEVEL = rf"(?:{'|'.join(LEVEL_UNITS)})(?![a-zA-Z0-9/])"
LEVEL_OF_COLUMN = re.compile(rf"{OF_A_LEVEL}{UNIT_OF_LEVEL}")
SPACED_LEVEL = re.compile(
    rf"(?:^|(?<=at )|(?<=bei )|(?<=level )|(?<=@ )|(?<=@)|(?<=[(\[])){OF_A_LEVEL} {UNIT_OF_LEVEL}"
)
#: Level in a name that has another unit, "Disp 3 N [um]"; without one, "Force 3 N" may be channel 3 in newtons.
LEVEL_BESIDE_UNIT = re.compile(rf"{OF_A_LEVEL} {UNIT_OF_LEVEL}")
WAY_OF_COLUMN = re.compile(r"(?<![a-z])(?:up|down|forward|backward)(?![a-z])", re.IGNORECASE)
#: Length in the name of a run, such as the set point of a displacement.
LENGTH_IN_NAME = re.compile(rf"{NUMBER}[uµμnm]?m(?![A-Za-z])")
#: Number with a unit other than that of a level: a place, "acc 200mm", or an imposed value, "Weg 5um" and "Kraft 5um".
QUANTITY_OF_COLUMN = re.compile(r"(?<![A-Za-z\d.])\d+(?:[.,p]\d+)?(?:[uµμmn]m|rpm|k?Hz|Nm|deg|K|C|bar)(?![a-zA-Z0-9])")
OF_COLUMN = (LEVEL_OF_COLUMN, SPACED_LEVEL, REPEAT_IN_NAME, RUN_IN_NAME, WAY_OF_COLUMN)


def split_name(name: str, *patterns: re.Pattern[str], has_unit: bool = True) -> tuple[str, str]:
    """Split the name of a channel: name without the words that match the patterns outside its unit, and these words.

    Parameters
    ----------
    name
        Name of a column: "A_3N rep2 [um]".
    patterns
        Patterns that distinguish runs.
    has_unit
        Whether the name may contain the unit.

    Returns
    -------
    "A [um]" and "3N rep2".
    """
    unit = find_unit(name).unit if has_unit else ""
    place = -1 if any(pattern.fullmatch(unit) for pattern in patterns) else name.rfind(unit)
    plain = f"{name[:place]}\0{name[place + len(unit) :]}" if unit and place >= 0 else name
    result: list[str] = []
    for pattern in patterns:
        for match in reversed([*pattern.finditer(plain)]):
            if not (LEVEL_IN_NAME.fullmatch(match[0]) and OTHER_FORCE.search(plain[: match.start()])):
                result.append(re.sub(r"(?<=\d) ", "", match[0]))
                plain = plain[: match.start()] + plain[match.end() :]
    if not result:
        return name, ""
    plain = re.sub(r"[(\[]\s*[)\]]", "", plain)
    plain = re.sub(r"([ _-])[ _-]+", r"\1", re.sub(r"\s*@\s*", " ", plain))
    plain = re.sub(r"[ _-]+(?=[(\[])", " ", plain).strip(" _-")
    return plain.replace("\0", unit), " ".join(result)


def find_frequency_in_name(name: str) -> float | None:
    """Frequency in a name, such as "dwell_79.80Hz" [Hz]; None without one."""
    match = FREQUENCY_IN_NAME.search(name)
    return decimal(match[1]) * (1e3 if match[2] else 1.0) if match else None


def repeat_in_name(name: str) -> int | None:
    """Number of the repeat in a name such as "sine_rep2"; None without one."""
    match = REPEAT_IN_NAME.search(name)
    return int(match[1]) if match else None


#: Words of a name for the place of a sensor.
PLACE = re.compile(
    r"tip|mid|middle|root|base|top|bottom|left|right|cent(?:er|re)|spitze|mitte|wurzel|fu(?:ss|ß)|links|rechts|oben|unten|"
    r"hub|shroud|rim|platform|(?:tip|root|mid|sensor|node|point|pos|position|ch|channel|kanal|punkt|knoten)\d+",
    re.IGNORECASE,
)
#: Words that number or date a file: "a", "2nd", "20240312T1011", "10h31", "Mar".
OF_A_FILE = re.compile(
    r"jan|feb|mar|mrz|apr|may|mai|jun|jul|aug|sep|oct|okt|nov|dec|dez|[a-z]|"
    r"\d+(?:st|nd|rd|th)|\d{6,}T\d+Z?|\d+(?:h\d+)(?:m\d+s?)?|\d+[a-z]{3}\d{2,4}",
    re.IGNORECASE,
)


def list_condition_words(name: str) -> list[str]:
    """Words of a file name that are neither run, level, frequency, time nor place: "with", "damper", "12Nm"."""
    for match in reversed(find_levels_in_name(name)):
        name = name.replace(match[0], "_")
    for pattern in (FREQUENCY_IN_NAME, REPEAT_IN_NAME, RUN_IN_NAME, WAY):
        name = pattern.sub("_", name)
    words = [word for word in re.split(r"[^\w.,]+|_+|(?<!\d)[.,]|[.,](?!\d)", name) if word]
    words = [word if word[0].isdigit() else re.sub(r"(?<![a-z]\d)\d+$", "", word, flags=re.I) for word in words]
    return [
        word for word in words if not (OF_A_RUN.fullmatch(word) or PLACE.fullmatch(word) or OF_A_FILE.fullmatch(word))
    ]


def find_last_number(name: str) -> int:
    """Last number in a name that is not a level or a frequency; 0 if there is none."""
    numbers = re.findall(r"\d+", FREQUENCY_IN_NAME.sub("", LEVEL_IN_NAME.sub("", name)))
    return int(numbers[-1]) if numbers else 0


def make_naming_scheme(name: str) -> str:
    """Name without the words that distinguish runs of one test: level, frequency, repeat, direction, a final number.

    Parts of the path of a group that contain nothing else are removed: "level_3N/rep1/up" gives the same scheme as
    "level_3N_rep1".
    """
    for pattern in (WAY, LEVEL_IN_NAME, FREQUENCY_IN_NAME, REPEAT_IN_NAME):
        name = pattern.sub("", name)
    parts = []
    for part in re.split(r"[./]", re.sub(r"[({\[]\d+[)}\]]", "", name)):
        words = [word for word in re.split(r"[_ -]+", part) if word and word.lower() not in BESIDE]
        parts += ["_".join(words)] if words else []
    return re.sub(r"[_ -]?\d+$", "", "/".join(parts))


def decimal(text: str) -> float:
    """Number with a point, a comma or a "p" before its decimals."""
    return float(text.replace(",", ".").replace("p", ".").replace("P", "."))
