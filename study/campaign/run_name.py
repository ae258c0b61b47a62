"""What the names of files and groups say of a run: level, frequency, repeat, direction of sweep, configuration."""

import re

#: Words that say that a structure was measured without its contacts.
FREE = {"free", "frei", "unjointed", "nocontact"}
#: Words in a row that say that it had them. They count beside "free", too, since every ring-down is a free decay.
WITH_CONTACTS = re.compile(r"\b(?:jointed|assembled|(?:with|mit) (?:joint|contact|kontakt))")
WITHOUT_CONTACTS = re.compile(rf"\b(?:(?:{'|'.join(sorted(FREE))})\b|(?:without|no|ohne) (?:joint|contact|kontakt))")
NUMBER = r"(?<![\d.])(\d+(?:[.,p]\d+)?)[ _]?"
LEVEL_IN_NAME = re.compile(rf"{NUMBER}(?:N|newton|V|volt)(?![a-zA-Z])")
FREQUENCY_IN_NAME = re.compile(rf"{NUMBER}(k?)Hz(?![a-z])", re.IGNORECASE)
REPEAT_IN_NAME = re.compile(r"(?<![a-z])(?:rep|repeat|repetition|wiederholung)[ _-]?(\d+)", re.IGNORECASE)
WAY = re.compile(r"(?<![a-z])(up|down)(?![a-z])[_ /-]?", re.IGNORECASE)
#: Words of a name that tell a run, its level, direction, time or configuration, and no sensor.
RUN = "rep|repeat|run|lauf|test|trial|versuch|meas|measurement|messung|hit|impact|shot|schlag|decay|level|sweep"
WHEN = "day|tag|before|after|vorher|nachher|up|down|forward|backward|auf|ab"
CONFIGURATION = "|".join([*sorted(FREE), "jointed"])
OF_A_RUN = re.compile(rf"({RUN}|{WHEN}|{CONFIGURATION})?\d*|\d+k?Hz", re.IGNORECASE)
#: Words that stand beside the level or number of a run.
BESIDE = {"level", "rep", "repeat", "repetition"}


def frequency_in_name(name: str) -> float | None:
    """Frequency in a name, such as "dwell_79.80Hz" [Hz]; None without one."""
    match = FREQUENCY_IN_NAME.search(name)
    return decimal(match[1]) * (1e3 if match[2] else 1.0) if match else None


def repeat_in_name(name: str) -> int | None:
    """Number of the repeat in a name that calls it so, such as "sine_rep2"; None without one."""
    match = REPEAT_IN_NAME.search(name)
    return int(match[1]) if match else None


def last_number(name: str) -> int:
    """The last number in a name that is no level or frequency; 0 if there is none."""
    numbers = re.findall(r"\d+", FREQUENCY_IN_NAME.sub("", LEVEL_IN_NAME.sub("", name)))
    return int(numbers[-1]) if numbers else 0


def naming_scheme(name: str) -> str:
    """A name without what tells the runs of one test apart: level, frequency, repeat, direction, a number at its end.

    Parts of the path of a group that say nothing else drop out: "level_3N/rep1/up" is as good as "level_3N_rep1".
    """
    for said in (WAY, LEVEL_IN_NAME, FREQUENCY_IN_NAME, REPEAT_IN_NAME):
        name = said.sub("", name)
    parts = []
    for part in re.split(r"[./]", re.sub(r"[({\[]\d+[)}\]]", "", name)):
        words = [word for word in re.split(r"[_ -]+", part) if word and word.lower() not in BESIDE]
        parts += ["_".join(words)] if words else []
    return re.sub(r"[_ -]?\d+$", "", "/".join(parts))


def decimal(text: str) -> float:
    """A number with a point, a comma or a "p" before its decimals."""
    return float(text.replace(",", ".").replace("p", ".").replace("P", "."))
