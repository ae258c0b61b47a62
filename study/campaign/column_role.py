"""Role of a column, judged from the file, its unit, its name and its values."""

import re
import unicodedata
from dataclasses import dataclass
from enum import Enum

import numpy as np

from correlation.campaign.measurement import LOAD_CELL, SI_UNIT
from correlation.campaign.measurement_unit import STRAIN, find_base_unit, find_root_units
from correlation.campaign.passes import SWEEP_WORDS
from correlation.file.column import Column
from correlation.file.quantity import FORCE_QUANTITY, MOTION_WORDS, OF_UNIT
from correlation.file.unit_label import find_suffix, read_unit, split_label
from study.campaign.motion_ratio import is_motion_ratio
from study.campaign.unknown_unit import find_unknown_unit, says_counts, says_strain


class Role(Enum):
    """Role of a column in its table."""

    FREQUENCY = "frequency"
    TIME = "time"
    FORCE = "force"
    RESPONSE = "response"
    PHASE = "phase"
    LEVEL = "level"
    SWEEP = "sweep"
    ORDER = "order"
    REPEAT = "repeat"
    HARMONIC = "harmonic"
    SENSOR = "name of the sensor"
    COHERENCE = "coherence"
    MODE = "number or name of the mode"
    DAMPING = "damping ratio"
    FOREIGN = "not a motion, not used"
    OTHER = "not used"


class ComplexPart(Enum):
    """Part of a complex number that a column contains."""

    VALUE = "value"
    AMPLITUDE = "amplitude"
    REAL = "real part"
    IMAGINARY = "imaginary part"


@dataclass(frozen=True, kw_only=True)
class Recognised:
    """Judgement on one column.

    Parameters
    ----------
    role
        Role of the column.
    part
        Part of a complex number.
    quantity
        Quantity, such as "displacement", "velocity", "acceleration", "force", "voltage", "strain"; empty if unknown.
    unit
        Unit; empty if unknown.
    evidence
        Reason of the judgement, in words.
    stem
        Words of its name that distinguish it from other columns of its role.
    assumed
        Whether quantity or unit are assumed, such as from a name without a unit.
    """

    role: Role
    part: ComplexPart = ComplexPart.VALUE
    quantity: str = ""
    unit: str = ""
    evidence: str = ""
    stem: str = ""
    assumed: bool = False


MOTIONS = ("displacement", "velocity", "acceleration")
WORDS: dict[Role, frozenset[str]] = {
    Role.FREQUENCY: frozenset(
        [
            "frequency",
            "freq",
            "freqs",
            "frequenz",
            "eigenfrequency",
            "eigenfrequenz",
            "f",
            "hz",
            "omega",
            "om",
            "drivefrequency",
            "kreisfrequenz",
        ]
    ),
    Role.TIME: frozenset(["time", "t", "zeit", "times"]),
    Role.FORCE: frozenset(["force", "kraft", "load", "hammer", "shaker", "excitation", "impact", "drive", "input"]),
    Role.LEVEL: frozenset(["level", "levels", "stufe", "setpoint", "forcing"]),
    Role.SWEEP: frozenset(["sweep", "direction", "updown", "branch", "richtung"]),
    Role.ORDER: frozenset(["order", "index", "sequence"]),
    Role.REPEAT: frozenset(["repeat", "repetition", "rep", "wiederholung"]),
    Role.HARMONIC: frozenset(["harmonic", "order_of_harmonic"]),
    Role.COHERENCE: frozenset(["coherence", "coh", "gamma", "kohaerenz", "kohärenz"]),
    Role.PHASE: frozenset(["phase", "phi", "ph", "phas", "angle", "arg"]),
}
PARTS = {
    ComplexPart.AMPLITUDE: frozenset(["amplitude", "amp", "ampl", "magnitude", "mag", "abs", "modulus", "betrag"]),
    ComplexPart.REAL: frozenset(["real", "re", "realteil"]),
    ComplexPart.IMAGINARY: frozenset(["imag", "imaginary", "im", "imaginärteil", "imaginaerteil"]),
}
#: Words for the convention of an amplitude.
OF_AMPLITUDE = frozenset(["rms", "pk", "pp"])
#: Names of ratios to a force.
RATIOS = frozenset(["frf", "h", "tf", "receptance", "mobility", "accelerance", "inertance", "compliance", "hfrf"])
#: Names of a force, in newtons unless a unit is given; "drive" or "shaker" may also be a voltage.
FORCE_WORDS = FORCE_QUANTITY | {"hammer", "impact"}
#: Symbol of a force: F, Fx, F1, F_amp. "F" alone may also be a frequency.
FORCE_SYMBOL = re.compile(r"F(?:[xyz]|_?\d+)?(?![A-Za-z])")
#: Lower-case symbol of a force; it is that of a frequency unless some values are negative.
SMALL_FORCE_SYMBOL = re.compile(r"f(?:[xyz]|_?\d+)?(?![A-Za-z])")
#: Names of a pressure, as of a microphone.
PRESSURE_WORDS = frozenset(
    ["mic", "microphone", "mikrofon", "pressure", "sound", "spl", "schall", "schalldruck", "druck"]
)
#: Names of a temperature, as of a thermocouple.
TEMPERATURE_WORDS = frozenset(["temperature", "temp", "temperatur", "thermocouple", "thermoelement"])
#: Names of the spectrum of one or two channels, which is not a frequency response.
SPECTRUM_WORDS = frozenset(
    [
        "fft",
        "spectrum",
        "spectra",
        "spec",
        "spektrum",
        "autospectrum",
        "crossspectrum",
        "autopower",
        "crosspower",
        "psd",
        "asd",
        "csd",
        "apsd",
        "cpsd",
    ]
)
#: Names of the scatter of another column.
SPREAD_WORDS = frozenset(
    ["std", "stddev", "stdev", "sd", "sigma", "deviation", "uncertainty", "error", "err", "variance", "streuung"]
)
#: Names of a voltage that drives a shaker, or of its set point.
DRIVE_WORDS = frozenset(
    [
        "voltage",
        "spannung",
        "anregung",
        "erregung",
        "excitation",
        "sollwert",
        "generator",
        "source",
        "command",
        "ansteuerung",
    ]
)
#: Names of load cells behind a contact line, such as R3.
LOAD_CELL_NAME = re.compile(r"(?:R|LC|load[ _]?cell)[ _]?[1-9](?![0-9])", re.IGNORECASE)
#: A ratio to a force or voltage, such as (m/s^2)/N.
RATIO = re.compile(r"\(?(.+?)\)?/\(?(m?N|kN|lbf|kgf|V)\)?")
#: Index of a channel in an array: H(:,2), acc[0].
INDEX = re.compile(r"[(\[](?::,)?(\d+)[,\d]*(?:,:)?[)\]]$")
#: Part of a complex number in brackets: "H (Real)", "Signal 2 (Imag.)", "tip (phase)".
IN_BRACKETS = re.compile(
    rf"[\[(]\s*({'|'.join([*sorted(frozenset().union(*PARTS.values())), 'phase', 'phas'])})\.?\s*[\])]", re.IGNORECASE
)
#: End of the evidence of the parts of a lock-in amplifier.
QUADRATURE = "are signed: in phase, and in quadrature"
#: Reasons why a channel is not used.
NO_VALUE, UNKNOWN_UNIT = "it has no value in any row", "unknown unit"
#: Roles recognised by name whose columns need no unit.
WITHOUT_UNIT = {Role.COHERENCE, Role.SWEEP, Role.ORDER, Role.REPEAT, Role.HARMONIC}


def recognise_column(column: Column, name: str) -> Recognised:
    """Recognise role, part, quantity and unit of one column without its table.

    Parameters
    ----------
    column
        Column.
    name
        Its name within its table.
    """
    words = name_words(name)
    if column.words:
        return _recognise_words(column, words)
    if not np.isfinite(column.values).any():
        return Recognised(role=Role.OTHER, evidence=NO_VALUE)
    unit, reason = find_unit_of(column, name)
    quantity = OF_UNIT.get(unit, "")
    given = {"time": Role.TIME, "frequency": Role.FREQUENCY, "coherence": Role.COHERENCE}.get(column.function)
    if given is not None and column.abscissa is None and given is not Role.COHERENCE:
        return Recognised(role=given, unit=unit, evidence="stated in the file")
    if given is Role.COHERENCE:
        return Recognised(role=given, evidence="stated in the file", stem=_make_stem(words, name))
    part = _find_part(column, words)
    stem = _make_stem(words, name)
    by_name = _find_role(words, quantity)
    if by_name not in WITHOUT_UNIT and says_strain(column, name):
        return Recognised(
            role=Role.RESPONSE, part=part, quantity=STRAIN, unit=STRAIN, evidence="its unit is a strain", stem=stem
        )
    # A sensor in counts gets a sensitivity; a force or a time in counts cannot be used.
    in_counts = by_name is None and says_counts(column, name)
    if by_name not in WITHOUT_UNIT and not in_counts and (foreign := find_unknown_unit(column, name)):
        return Recognised(role=Role.OTHER, evidence=f'{UNKNOWN_UNIT} "{foreign}"', stem=stem)
    ratio = find_ratio_quantity(unit)
    if ratio:
        return Recognised(role=Role.RESPONSE, part=part, quantity=ratio, unit=unit, evidence=reason, stem=stem)
    if foreign := _foreign(words, unit, quantity) or _spectrum(words, name, by_name) or _spread(words):
        return Recognised(role=Role.FOREIGN, unit=unit, evidence=foreign)
    if by_name is Role.PHASE or (quantity == "angle" and not set(words) & _list_motion_words()):
        return _recognise_phase(column, unit, reason, stem)
    if by_name in {Role.LEVEL, Role.SWEEP, Role.ORDER, Role.REPEAT, Role.HARMONIC, Role.COHERENCE}:
        return Recognised(role=by_name, quantity=quantity, unit=unit, evidence=f'called "{name}"', stem=stem)
    if quantity in {"time", "frequency"} and _may_be_abscissa(column):
        role = Role.TIME if quantity == "time" else Role.FREQUENCY
        return Recognised(role=role, quantity=quantity, unit=unit, evidence=reason)
    if (
        (by_name is Role.TIME or by_name is Role.FREQUENCY)
        and quantity in {"", "time", "frequency"}
        and _may_be_abscissa(column)
        and not _contradicts(column, words, by_name)
    ):
        return _recognise_abscissa(by_name, name, unit, words)
    if quantity == "force" and LOAD_CELL_NAME.match(name):
        why = f'called "{name}": a load cell'
        return Recognised(role=Role.RESPONSE, part=part, quantity=LOAD_CELL, unit=unit, evidence=why, stem=stem)
    if quantity == "force" or (by_name is Role.FORCE and quantity in {"", "voltage"}) or _is_drive(words, quantity):
        evidence = reason if quantity and quantity != "voltage" else f'called "{name}"'
        if not unit and set(words) & FORCE_WORDS:
            return _recognise_force_without_unit(column, name, part, stem)
        return Recognised(
            role=Role.FORCE, part=part, quantity=quantity or "force", unit=unit, evidence=evidence, stem=stem
        )
    # A single letter in the name of a channel with a point, such as "58 #2 1Z+/1Z+", is its direction.
    telling = {word for word in words if column.response is None or len(word) > 1}
    named = next((motion for motion in MOTIONS if telling & MOTION_WORDS[motion]), "")
    if set(words) & {"base", "table", "ground"} and "acceleration" in {quantity, named}:
        why = f'called "{name}": the base is shaken'
        return Recognised(role=Role.FORCE, part=part, quantity="acceleration", unit=unit, evidence=why, stem=stem)
    if quantity in {*MOTIONS, "voltage"}:
        return Recognised(role=Role.RESPONSE, part=part, quantity=quantity, unit=unit, evidence=reason, stem=stem)
    if named or part is not ComplexPart.VALUE or np.iscomplexobj(column.values) or column.function:
        kind = "complex numbers" if np.iscomplexobj(column.values) else f"a channel of {column.function}"
        evidence = f'called "{name}"' if named or part is not ComplexPart.VALUE else kind
        if not unit and (unit := find_listed_unit(column, named)):
            evidence += f", and {unit} is listed for it"
        return Recognised(
            role=Role.RESPONSE, part=part, quantity=named, unit=unit, evidence=evidence, stem=stem,
            assumed=bool(named) and not unit,
        )  # fmt: skip
    return Recognised(role=Role.OTHER, unit=unit, evidence=f'"{name}" is not recognised', stem=stem)


def recognise_force_symbol(column: Column, name: str) -> Recognised | None:
    """Recognise a column named F, Fx, F_amp as a force, also f if it has negative values; None for others.

    Parameters
    ----------
    column
        Column.
    name
        Its name within its table.
    """
    if not (FORCE_SYMBOL.match(name) or (SMALL_FORCE_SYMBOL.match(name) and _has_sign(column))):
        return None
    words = name_words(name)
    return _recognise_force_without_unit(column, name, _find_part(column, words), _make_stem(words, name))


def find_unit_of(column: Column, name: str) -> tuple[str, str]:
    """Unit of a column and its source, the file or the end of the name; both are empty if unknown."""
    if column.unit:
        return column.unit, f"unit {column.unit} in the file"
    if re.fullmatch(r"V\d*", name):
        return "V", f'called "{name}"'
    ending, unit = find_suffix(INDEX.sub("", split_label(name)[0]).rstrip("_"))  # MATLAB has "Acc (g)" as "Acc_g_"
    return (unit, f'its name ends in "_{ending}"') if unit else ("", "")


def find_listed_unit(column: Column, quantity: str) -> str:
    """Unit of a quantity in a list of units such as "s, m/s^2" in the facts of a column; empty if there is none."""
    texts = [text for key, text in column.facts.items() if key.lower() in {"units", "unit"}]
    units = [read_unit(part) for text in texts for part in text.split(",")]
    return next((unit for unit in units if OF_UNIT.get(unit) == quantity), "")


def name_words(name: str) -> list[str]:
    """Lower-case words of a name without its unit: "leftAcc_mm_s2" gives left and acc."""
    label = split_label(name)[0]
    plain = (re.sub(r"[\[({].*", "", label) or name).rstrip("_")
    ending, _ = find_suffix(plain)
    plain = " ".join([plain[: -len(ending) - 1] if ending else plain, *IN_BRACKETS.findall(label)])
    plain = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", plain)
    return re.findall(r"[^\W\d_²³]+|\d+", unicodedata.normalize("NFC", plain).lower())


def _list_motion_words() -> set[str]:
    return set().union(*MOTION_WORDS.values()) - {"x", "y", "z", "u", "v", "a"}


def _make_stem(words: list[str], name: str) -> str:
    """Words of a name, except those for coherence, part or amplitude convention, and its index in an array."""
    common = frozenset().union(*PARTS.values(), WORDS[Role.PHASE], WORDS[Role.COHERENCE], OF_AMPLITUDE)
    index = INDEX.search(name)
    return " ".join(word for word in words if word not in common) + (f" {index[1]}" if index else "")


def _recognise_abscissa(role: Role, name: str, unit: str, words: list[str]) -> Recognised:
    """Time or frequency by its name; without a known unit s, Hz or rad/s is assumed."""
    angular = bool(set(words) & {"omega", "om", "angular", "circular", "kreisfrequenz"})
    usual = "s" if role is Role.TIME else "rad/s" if angular else "Hz"
    says = "" if unit else f", and no unit in the file: {usual} assumed"
    return Recognised(role=role, unit=unit or usual, evidence=f'called "{name}"{says}', assumed=not unit)


def _foreign(words: list[str], unit: str, quantity: str) -> str:
    """Reason why a column is not a motion, force or voltage; empty if it may be one or has no dimension."""
    for kind, of_kind in (("pressure", PRESSURE_WORDS), ("temperature", TEMPERATURE_WORDS)):
        if quantity in {"", "voltage", "angle"} and (named := sorted(set(words) & of_kind)):
            return f'by "{named[0]}" in its name a {kind}, not a motion'
    if not unit or quantity:
        return ""
    of_force = RATIO.fullmatch(unit)
    try:
        find_base_unit(of_force[1] if of_force else unit)
    except ValueError:
        is_number = "/" not in unit and not _has_dimension(unit)  # such as a percentage
        return "" if is_number or is_motion_ratio(unit) else f"{unit} is not a unit of motion, force or voltage"
    return ""


def _spectrum(words: list[str], name: str, by_name: Role | None) -> str:
    """Reason why a column is a spectrum, also from a word in brackets; empty if it is not."""
    named = sorted({*words, *re.findall(r"[a-z]+", name.lower())} & SPECTRUM_WORDS)
    if not named or set(words) & RATIOS or by_name in {Role.TIME, Role.FREQUENCY}:
        return ""
    return f'by "{named[0]}" in its name a spectrum, neither a motion nor a ratio of motion to force'


def _spread(words: list[str]) -> str:
    """Reason why a column is the scatter of another one; empty if it is not."""
    named = sorted(set(words) & SPREAD_WORDS)
    return f'by "{named[0]}" in its name the scatter of another column' if named else ""


def _has_dimension(unit: str) -> bool:
    try:
        return bool(find_root_units(unit)[1])
    except ValueError:
        return False


def _recognise_force_without_unit(column: Column, name: str, part: ComplexPart, stem: str) -> Recognised:
    """Force by its name, in newtons unless the facts of the column list another unit."""
    listed = {quantity: find_listed_unit(column, quantity) for quantity in ("force", "voltage")}
    quantity = next((quantity for quantity, unit in listed.items() if unit), "")
    unit = listed.get(quantity, "N")
    says = f"{unit} is listed for it" if quantity else "no unit in the file: N assumed"
    return Recognised(
        role=Role.FORCE, part=part, quantity=quantity or "force", unit=unit, evidence=f'called "{name}", and {says}',
        stem=stem, assumed=not quantity,
    )  # fmt: skip


def _recognise_words(column: Column, words: list[str]) -> Recognised:
    if {word.lower() for word in column.words} <= set(SWEEP_WORDS):
        return Recognised(role=Role.SWEEP, evidence=f"it contains the words {', '.join(column.words)}")
    if set(words) & {"sensor", "channel", "location", "signal", "point"}:
        return Recognised(role=Role.SENSOR, evidence=f"it contains the words {', '.join(column.words[:4])}")
    return Recognised(role=Role.OTHER, evidence=f"it contains the words {', '.join(column.words[:4])}")


def _find_role(words: list[str], quantity: str) -> Role | None:
    roles = [role for role in WORDS if set(words) & WORDS[role]]
    if quantity != "force" and set(words) & _list_motion_words() and not set(words) & FORCE_QUANTITY:
        roles = [role for role in roles if role is not Role.FORCE]  # "acc_drive" is the motion of the drive
    if Role.PHASE in roles:
        return Role.PHASE
    if quantity == "force" and Role.FORCE in roles:
        return Role.FORCE
    return roles[0] if roles else None


def _is_drive(words: list[str], quantity: str) -> bool:
    """Whether a voltage is that of a signal generator, not of a motion sensor."""
    return quantity == "voltage" and bool(set(words) & DRIVE_WORDS) and not set(words) & _list_motion_words()


def _find_part(column: Column, words: list[str]) -> ComplexPart:
    if np.iscomplexobj(column.values):
        return ComplexPart.VALUE
    return next((part for part, family in PARTS.items() if set(words) & family), ComplexPart.VALUE)


def find_ratio_quantity(unit: str) -> str:
    """Quantity of a ratio to a force, such as acceleration for (m/s^2)/N or 1/kg; empty if the unit is not a ratio."""
    match = RATIO.fullmatch(unit)
    quantity = OF_UNIT.get(match[1], "") if match else ""
    if quantity in MOTIONS or "/" not in unit:
        return quantity if quantity in MOTIONS else ""
    try:
        dimension = find_root_units(unit)[1]
    except ValueError:
        return ""
    return next((motion for motion in MOTIONS if find_root_units(f"({SI_UNIT[motion]})/N")[1] == dimension), "")


def _may_be_abscissa(column: Column) -> bool:
    """Whether values change and are real."""
    return not np.iscomplexobj(column.values) and len(np.unique(column.values)) > 1


def _contradicts(column: Column, words: list[str], by_name: Role) -> bool:
    """Whether values contradict a frequency (some are negative) or a time "T1" (some fall: it may be a temperature)."""
    if by_name is Role.FREQUENCY:
        return _has_sign(column)
    return (
        not set(words) & WORDS[Role.TIME] - {"t"} and not column.unit and bool((np.diff(column.values.real) < 0).any())
    )


def _has_sign(column: Column) -> bool:
    """Whether some values are negative."""
    return bool((column.values.real < 0).any())


def _recognise_phase(column: Column, unit: str, evidence: str, stem: str) -> Recognised:
    """Phase; without a unit, its range decides between degrees and radians."""
    largest = float(np.nanmax(np.abs(column.values))) if len(column.values) else 0.0
    if unit in {"deg", "rad"}:
        beyond = unit == "rad" and largest > 20.0
        warning = f", but it reaches {largest:.4g}: are these degrees?" if beyond else ""
        return Recognised(role=Role.PHASE, quantity="angle", unit=unit, evidence=evidence + warning, stem=stem)
    unit = "deg" if largest > 2.1 * np.pi else "rad"
    return Recognised(role=Role.PHASE, quantity="angle", unit=unit, evidence=f"it reaches {largest:.4g}", stem=stem)
