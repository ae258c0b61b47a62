"""Kind of a table of a measured file: frequency responses, stepped sine, ring-downs, loops, steady states, records."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from correlation.campaign.measurement_unit import STRAIN
from correlation.file.arrays.first_column import OF_ARRAYS, rises_evenly
from correlation.file.column import Column
from correlation.file.quantity import MOTION_WORDS, OF_UNIT
from study.campaign.column_role import (
    MOTIONS,
    PRESSURE_WORDS,
    RATIOS,
    SPECTRUM_WORDS,
    UNKNOWN_UNIT,
    ComplexPart,
    Recognised,
    Role,
    find_ratio_quantity,
    name_words,
    recognise_column,
    recognise_force_symbol,
)
from study.campaign.first_column import EITHER, recognise_first_columns
from study.campaign.lock_in import recognise_quadratures
from study.campaign.mode_table import recognise_modes
from study.campaign.motion_ratio import TRANSMISSIBILITY, is_motion_ratio
from study.campaign.set_point import changes_between_passes
from study.campaign.shaken_base import recognise_controller
from study.campaign.table import MeasuredTable, make_file_stem
from study.campaign.time_history import (
    IN_LINES,
    SECONDS,
    WINDOWS,
    distortion,
    find_strongest_line,
    judge_history,
    turns_with,
)
from study.campaign.unknown_unit import find_written_unit


class Kind(Enum):
    """Kind of a table."""

    TIDY = "tidy table"
    FREQUENCY_RESPONSE = "frequency responses"
    STEPPED_SINE = "stepped sine"
    RING_DOWN = "ring-downs"
    LOOP = "force-displacement loops"
    STEADY_STATE = "steady states over time"
    RECORD = "time record"
    MODES = "natural modes"
    NOT_USED = "not used"


@dataclass(frozen=True, kw_only=True, eq=False)
class JudgedTable:
    """Table with the judgement on its kind and its columns.

    Parameters
    ----------
    table
        Table.
    kind
        Kind of the table.
    evidence
        Reason of the judgement, in words.
    columns
        Judgement on each column, by its name.
    settings
        Columns that are constant in blocks of rows: each combination of their values is a separate series.
    """

    table: MeasuredTable
    kind: Kind
    evidence: str
    columns: Mapping[str, Recognised]
    settings: tuple[Column, ...] = ()

    def of_role(self, *roles: Role) -> list[Column]:
        """Columns of some roles, in the order of the file; settings only if the role of levels is among them."""
        used = {column.name for column in self.settings} if Role.LEVEL not in roles else set()
        return [
            column
            for column in self.table.columns
            if self.columns[column.name].role in roles and column.name not in used
        ]

    def rows(self) -> list[dict[str, float | str]]:
        """Combinations of the settings in the order of the file; without settings a single empty one."""
        if not self.settings:
            return [{}]
        stacked = np.stack([column.values for column in self.settings], axis=1)
        known = np.flatnonzero(np.isfinite(stacked).all(axis=1))
        _, first = np.unique(stacked[known], axis=0, return_index=True)
        first = known[first]
        return [{column.name: get_value(column, row) for column in self.settings} for row in np.sort(first).tolist()]

    def mask(self, rows: Mapping[str, float | str]) -> np.ndarray:
        """Mask of the rows of one combination, shape (n,)."""
        mask = np.ones(len(self.table.columns[0].values), dtype=bool)
        for column in self.settings:
            wanted = rows[column.name]
            mask &= column.values == (column.words.index(str(wanted)) if column.words else wanted)
        return mask


#: Format of tables whose header the user can edit.
PLAIN_TABLE = "csv"
#: Beginning of the evidence of a time or frequency that is not the abscissa.
SECOND = "a second"
#: Beginning of the evidence of a channel that only the name of its file or group describes.
OF_FILE = "the name of its file or group"
#: Columns of the tidy tables of a campaign.
TIDY = {"test", "order", "repeat", "sweep", "level", "frequency", "sensor", "harmonic", "real", "imag", "unit"}
#: Words in the names of files with frequency responses.
FRF_FILES = {"frf", "frfs", "hammer"}
LOOP_WORDS = {"loop", "loops", "hysteresis", "hysterese", "hyst", "damper", "friction", "cycle", "cyclic"}
SPECTRA = ("auto spectrum", "cross spectrum", "spectral density", "coherence", "correlation")
#: Smallest number of samples of a record or loop without a time.
FEWEST_SAMPLES = 200
MOST_SETTINGS = 60
#: Largest step of a time history, as a fraction of a period [-].
NYQUIST = 0.5
HERTZ = {"Hz": 1.0, "mHz": 1e-3, "kHz": 1e3, "rpm": 1 / 60, "rad/s": 1 / (2 * np.pi)}
#: Smallest prominence of a turning point over the range of the displacement [-], and smallest number of rows per cycle.
PROMINENT, ROWS_OF_CYCLE = 0.02, 20
#: Smallest fraction of power outside the fundamental, of a force in response to an imposed displacement [-].
DISTORTED = 1e-3
#: Smallest ratio of this fraction to that of the displacement, for unsteady cycles [-]: a shaker near a resonance also
#: distorts its force.
MUCH_LESS_HARMONIC = 10.0


def judge_table(table: MeasuredTable) -> JudgedTable:
    """Judge the kind of a table and the roles of its columns.

    Parameters
    ----------
    table
        Table of a measured file.
    """
    columns = {column.name: recognise_column(column, table.short_name(column)) for column in table.columns}
    columns = recognise_first_columns(table, _mark_raw_voltages(table, columns))
    columns = _mark_time_stamps(table, _choose_abscissa(table, _mark_force_symbols(table, columns)))
    if modes := recognise_modes(table, columns):
        why = "natural frequencies, a row for each mode"
        return JudgedTable(table=table, kind=Kind.MODES, evidence=why, columns={**columns, **modes})
    columns = _name_of_file(table, _mark_unknown_responses(table, _mark_strains(columns)))
    columns = recognise_quadratures(table, _mark_level_steps(table, _mark_dead_drives(table, columns)))
    columns = recognise_controller(table, columns)
    roles = {guess.role for guess in columns.values()}
    if {column.name for column in table.columns} >= TIDY:
        return JudgedTable(table=table, kind=Kind.TIDY, evidence="it has the columns of a tidy table", columns=columns)
    settings = _find_settings(table, columns)
    judged = JudgedTable(table=table, kind=Kind.NOT_USED, evidence="", columns=columns, settings=settings)
    if not judged.of_role(Role.RESPONSE):
        return _judge_as(judged, Kind.NOT_USED, _lacks_response(judged))
    if Role.TIME in roles:
        return _judge_time(judged)
    if Role.FREQUENCY in roles:
        return _judge_frequency(judged)
    if any(np.iscomplexobj(column.values) for column in table.columns):
        return _judge_as(judged, Kind.NOT_USED, f"its numbers are complex, and it has no frequency: {_to_add(table)}")
    if either := _describe_even_column(judged):
        return _judge_as(judged, Kind.NOT_USED, either)
    if len(table.columns[0].values) >= FEWEST_SAMPLES and _is_cycled(judged):
        return _judge_as(judged, Kind.LOOP, "a force and a slowly cycled displacement, and no time")
    if len(table.columns[0].values) >= FEWEST_SAMPLES:
        return _judge_as(judged, Kind.RECORD, "it has many samples, but neither time nor frequency")
    return _judge_as(
        judged, Kind.NOT_USED, "; ".join(["it has neither time nor frequency", *describe_unknown_units(judged)])
    )


def _lacks_response(judged: JudgedTable) -> str:
    """Reason why a table without a response is not used, from its other columns."""
    if foreign := judged.of_role(Role.FOREIGN):
        return f'it has no motion: "{foreign[0].name}": {judged.columns[foreign[0].name].evidence}'
    if unknown := describe_unknown_units(judged):
        return f"it has no response in a known unit: {'; '.join(unknown)}"
    if judged.of_role(Role.FORCE):
        return "it has a force but no response"
    if all(column.words for column in judged.table.columns):
        return "it contains text but no numbers"
    if not any(guess.role in {Role.TIME, Role.FREQUENCY} for guess in judged.columns.values()):
        either = _describe_even_column(judged)
        if either and judged.table.file.format in OF_ARRAYS:
            return either
        named = ", ".join(f'"{column.name}"' for column in judged.table.columns[:4])
        return (
            f"its columns {named} are not identified: write a header such as frequency [Hz], force [N], tip [mm], "
            "phase [deg] above them, or name them in [run.columns] (docs/campaign.md)"
            + (f"; {either}" if either else "")
        )
    return "it has no response"


def _to_add(table: MeasuredTable) -> str:
    """Remedy for complex numbers without frequencies, by the format of the file."""
    if table.file.format == "uff":
        return "give its abscissa in Hz, as type 18 in dataset 58"
    if table.file.format in OF_ARRAYS:
        return f'add a vector "freq" with their {len(table.columns[0].values)} frequencies in Hz'
    return "add a column freq [Hz] with the frequency of each row"


def _describe_even_column(judged: JudgedTable) -> str:
    """Sentence on a column in equal steps that may be a time or a frequency; empty without one."""
    column = next((one for one in judged.table.columns if judged.columns[one.name].evidence == EITHER), None)
    if column is None:
        return ""
    first, last = (f"{column.values[row].real:.6g}" for row in (0, -1))
    return (
        f'"{column.name}" goes from {first} to {last} in equal steps: if it is a time, name it time [s] in the file; '
        "if it is a frequency, freq [Hz]"
    )


def suggest_unit_remedy(judged: JudgedTable) -> str:
    """Remedy for a unit that is not understood."""
    in_manifest = 'name the column with its unit in the manifest, { column = "...", unit = "um" } (docs/campaign.md)'
    if judged.table.file.format != PLAIN_TABLE:
        return in_manifest
    return f"write a unit such as um, m/s^2, N or deg in its header, or {in_manifest}"


def describe_unknown_units(judged: JudgedTable) -> list[str]:
    """Sentences on columns whose unit is not understood, each with the remedy."""
    return [
        f'"{column.name}": {guess.evidence}; {suggest_unit_remedy(judged)}'
        for column in judged.of_role(Role.OTHER)
        if (guess := judged.columns[column.name]).evidence.startswith(UNKNOWN_UNIT)
    ]


def get_value(column: Column, row: int) -> float | str:
    """Value of a column in a row: a number, or a word."""
    value = float(column.values[row].real)
    return column.words[int(value)] if column.words else value


def _judge_as(judged: JudgedTable, kind: Kind, evidence: str) -> JudgedTable:
    return JudgedTable(**{**vars(judged), "kind": kind, "evidence": evidence})


def _mark_force_symbols(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Recognise F as a force, if another column is a time or a frequency."""
    forces = {
        column.name: force
        for column in table.columns
        if columns[column.name].role in {Role.FREQUENCY, Role.OTHER}
        and (columns[column.name].assumed or not columns[column.name].unit)
        and not column.words
        and (force := recognise_force_symbol(column, table.short_name(column)))
    }
    others = {guess.role for name, guess in columns.items() if name not in forces}
    return {**columns, **(forces if others & {Role.TIME, Role.FREQUENCY} else {})}


def _name_of_file(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Give channels of unknown quantity the quantity in the name of their file or group: "velocity.wav"."""
    words = set(name_words(f"{make_file_stem(table.file.path.name)} {table.path or table.group}"))
    unknown = [name for name, guess in columns.items() if guess.role is Role.RESPONSE and not guess.quantity]
    motions = [motion for motion in MOTIONS if any(len(word) > 1 for word in words & MOTION_WORDS[motion])]
    change: dict[str, Any] = {}
    if len(motions) == 1:
        change = {"quantity": motions[0], "assumed": True, "evidence": f"{OF_FILE} contains {motions[0]}"}
    elif words & PRESSURE_WORDS and not motions:
        change = {"role": Role.FOREIGN, "evidence": f"{OF_FILE} contains a pressure, which is not a motion"}
    elif words & {"force", "kraft"} and not motions and len(unknown) == 1:
        force = {"role": Role.FORCE, "quantity": "force", "unit": "N", "assumed": True}
        change = {**force, "evidence": f"{OF_FILE} contains force, and no unit is stated: N assumed"}
    return {**columns, **{name: replace(columns[name], **change) for name in unknown if change}}


def _mark_raw_voltages(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Mark a voltage with the name of a column in another unit as its raw reading: "Force (V)", "Force (N)"."""
    result = dict(columns)
    for column in table.columns:
        words = name_words(table.short_name(column))
        read = [
            other.name
            for other in table.columns
            if other is not column
            and OF_UNIT.get(unit := find_written_unit(other, other.name)) != "voltage"
            and unit
            and name_words(table.short_name(other)) == words
        ]
        if words and read and OF_UNIT.get(column.unit) == "voltage":
            why = f'the raw voltage of "{read[0]}"'
            result[column.name] = Recognised(role=Role.OTHER, unit=column.unit, evidence=why)
    return result


def _mark_strains(columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Mark strains as not used, if the table has a motion: their ratio to a displacement is unknown."""
    has_motion = any(guess.role is Role.RESPONSE and guess.quantity in MOTIONS for guess in columns.values())
    strains = [name for name, guess in columns.items() if guess.quantity == STRAIN] if has_motion else []
    why = "a strain, not a motion, and the table also contains a motion"
    return {**columns, **{name: Recognised(role=Role.FOREIGN, unit=STRAIN, evidence=why) for name in strains}}


def _choose_abscissa(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Choose the abscissa among several times or frequencies: the first with the most distinct values."""
    result = dict(columns)
    for role in (Role.TIME, Role.FREQUENCY):
        candidates = [column for column in table.columns if columns[column.name].role is role]
        best = max(candidates, key=lambda column: len(np.unique(column.values)), default=None)
        for column in candidates:
            if column is not best:
                result[column.name] = Recognised(role=Role.OTHER, evidence=f"{SECOND} {role.value}")
    return result


def _mark_time_stamps(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Mark a time in a table over frequency as a time stamp, if there are phases or its steps exceed half a period."""
    result = dict(columns)
    time, frequency = (
        next((one for one in table.columns if columns[one.name].role is role), None)
        for role in (Role.TIME, Role.FREQUENCY)
    )
    if time is None or frequency is None:
        return result
    others = [columns[one.name] for one in table.columns]
    steps = SECONDS.get(columns[time.name].unit, 1.0) * np.abs(np.diff(time.values))
    hertz = HERTZ.get(columns[frequency.name].unit, 1.0) * np.abs(frequency.values)
    if any(np.iscomplexobj(one.values) for one in table.columns) or any(
        guess.role is Role.PHASE or guess.part in {ComplexPart.REAL, ComplexPart.IMAGINARY} for guess in others
    ):
        why = "a time stamp: the table has amplitudes and phases over a frequency"
    elif np.nanmedian(steps) * np.nanmedian(hertz) > NYQUIST:
        why = "a time stamp: its steps are longer than half a period of the frequency column"
    else:
        return result
    result[time.name] = replace(columns[time.name], role=Role.OTHER, evidence=why)
    return result


def _mark_unknown_responses(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Recognise unknown columns and several voltages as responses, if no response is known over time or frequency."""
    roles = {guess.role for guess in columns.values()}
    result = dict(columns)
    if Role.RESPONSE in roles or not roles & {Role.TIME, Role.FREQUENCY}:
        return result
    voltages = [name for name, guess in columns.items() if guess.role is Role.FORCE and guess.quantity == "voltage"]
    # A single voltage is the drive; of several voltages any may be the drive.
    for name in voltages if len(voltages) > 1 else ():
        result[name] = replace(
            columns[name], role=Role.RESPONSE, evidence="only voltages: any of them may be the drive"
        )
    for column in table.columns:
        guess = columns[column.name]
        # A second time or frequency, or a column that may be one, is not a response.
        known = not guess.evidence.startswith((UNKNOWN_UNIT, SECOND, EITHER))
        if (
            guess.role is Role.OTHER
            and known
            and not column.words
            and len(np.unique(column.values)) > len(column.values) / 4
        ):
            why = "it varies, and no other column can be the response"
            result[column.name] = replace(guess, role=Role.RESPONSE, evidence=why)
    return result


def _mark_level_steps(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Recognise columns over frequency with few values, each constant over a pass, as levels: forces, or any column.

    A column with an unknown name is a level only if neither force nor level is known and it does not count the passes.
    """
    result = dict(columns)
    frequency = next((one.values for one in table.columns if columns[one.name].role is Role.FREQUENCY), None)
    if frequency is None:
        return result
    is_known = any(guess.role in {Role.FORCE, Role.LEVEL} for guess in columns.values())
    for column in table.columns:
        different = len(np.unique(column.values))
        few = 2 <= different <= min(20, len(column.values) / 5)
        if not few or not changes_between_passes(column.values, frequency):
            continue
        if columns[column.name].role is Role.FORCE:
            why = f"it has {different} values: set points of the force"
            result[column.name] = replace(columns[column.name], role=Role.LEVEL, evidence=why)
        elif columns[column.name].role is Role.OTHER and not is_known and _may_be_level(column):
            why = f"it has {different} values, each constant over a pass: levels"
            result[column.name] = Recognised(role=Role.LEVEL, unit=column.unit, evidence=why, assumed=True)
            is_known = True
    return result


def _may_be_level(column: Column) -> bool:
    """Whether a column with an unknown name may contain levels: positive numbers that do not count the passes."""
    values = np.unique(column.values)
    quantity = OF_UNIT.get(column.unit, "")
    if column.words or np.iscomplexobj(values) or not values[0] > 0 or quantity in {"frequency", "time", "angle"}:
        return False
    return quantity in {"force", "voltage"} or not np.array_equal(values, 1 + np.arange(len(values)))


def _mark_dead_drives(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Mark forces that are zero in all rows as not used, if there is another force."""
    forces = [one for one in table.columns if columns[one.name].role is Role.FORCE]
    dead = [one.name for one in forces if not np.any(one.values)]
    if len(dead) == len(forces):
        return dict(columns)
    why = "it is zero in all rows, and another column is the drive"
    return {**columns, **{name: replace(columns[name], role=Role.OTHER, evidence=why) for name in dead}}


def _find_settings(table: MeasuredTable, columns: Mapping[str, Recognised]) -> tuple[Column, ...]:
    """Columns that identify the series of a row: levels, sensors, harmonics, and over time also columns in blocks."""
    time = next((one.values for one in table.columns if columns[one.name].role is Role.TIME), None)
    settings = []
    for column in table.columns:
        role = columns[column.name].role
        different = len(np.unique(column.values))
        if role is Role.TIME or different > MOST_SETTINGS:
            continue
        named = role in {Role.LEVEL, Role.SENSOR, Role.HARMONIC}
        in_blocks = np.count_nonzero(np.diff(column.values)) < len(column.values) / 20
        may_be_measured = role in {Role.FORCE, Role.RESPONSE} and different > 1
        if named or (
            time is not None and in_blocks and not (may_be_measured and not changes_between_passes(column.values, time))
        ):
            settings.append(column)
    return tuple(settings)


def _judge_frequency(judged: JudgedTable) -> JudgedTable:
    responses = judged.of_role(Role.RESPONSE)
    if not responses:
        return _judge_as(judged, Kind.NOT_USED, "it has no response")
    functions = {column.function for column in responses}
    if all(any(word in function for word in SPECTRA) for function in functions):
        return _judge_as(judged, Kind.NOT_USED, f"{', '.join(sorted(functions))}: no phase relative to the force")
    if "transmissibility" in functions or any(is_motion_ratio(column.unit) for column in responses):
        return _judge_as(judged, Kind.NOT_USED, TRANSMISSIBILITY)
    if "frequency response" in functions:
        return _judge_as(judged, Kind.FREQUENCY_RESPONSE, "stated in the file")
    words = {word for column in responses for word in name_words(judged.table.short_name(column))}
    ratio = [column for column in responses if find_ratio_quantity(column.unit)]
    if ratio:
        return _judge_as(
            _keep_ratios(judged), Kind.FREQUENCY_RESPONSE, f'"{ratio[0].name}" is a ratio to a force, {ratio[0].unit}'
        )
    if judged.of_role(Role.COHERENCE):
        return _judge_as(judged, Kind.FREQUENCY_RESPONSE, "it has a coherence")
    if words & RATIOS and not judged.of_role(Role.FORCE):
        only = _keep_ratios(judged)
        return _judge_as(only, Kind.FREQUENCY_RESPONSE, f'a column is called "{sorted(words & RATIOS)[0]}"')
    of_file = set(name_words(make_file_stem(judged.table.file.path.name))) & FRF_FILES
    if of_file and not judged.of_role(Role.FORCE):
        return _judge_as(judged, Kind.FREQUENCY_RESPONSE, f'its file is called "{sorted(of_file)[0]}"')
    if (kind := _judge_spectral_lines(judged)) is not None:
        return kind
    return _judge_as(judged, Kind.STEPPED_SINE, "one row per frequency, not a ratio to a force")


def _keep_ratios(judged: JudgedTable) -> JudgedTable:
    """Mark complex responses without the unit or name of a ratio, such as spectra, as not used, if there are ratios."""
    called = {
        column.name: bool(find_ratio_quantity(column.unit) or set(name_words(judged.table.short_name(column))) & RATIOS)
        for column in judged.of_role(Role.RESPONSE)
        if np.iscomplexobj(column.values)
    }
    if not any(called.values()):
        return judged
    why = "complex numbers next to a frequency response, and neither unit nor name identifies them as one"
    change = {
        name: replace(judged.columns[name], role=Role.FOREIGN, evidence=why)
        for name, ratio in called.items()
        if not ratio
    }
    return replace(judged, columns={**judged.columns, **change})


def _judge_spectral_lines(judged: JudgedTable) -> JudgedTable | None:
    """Judge a table over the lines of a Fourier transform, in equal steps from 0 Hz; None for other frequencies."""
    frequency = judged.of_role(Role.FREQUENCY)[0]
    if frequency.values[0] != 0 or not rises_evenly(frequency):
        return None
    lines = "its frequencies are lines of a Fourier transform, in equal steps from 0 Hz"
    words = {*name_words(f"{make_file_stem(judged.table.file.path.name)} {judged.table.path}")}
    guesses = [judged.columns[column.name] for column in judged.table.columns]
    has_phase = any(np.iscomplexobj(column.values) for column in judged.of_role(Role.RESPONSE)) or any(
        guess.role is Role.PHASE or guess.part is ComplexPart.IMAGINARY for guess in guesses
    )
    # A response with a unit that is not that of a ratio to a force is a spectrum.
    of_motion = any(column.unit for column in judged.of_role(Role.RESPONSE))
    if has_phase and not of_motion and not judged.of_role(Role.FORCE) and not words & SPECTRUM_WORDS:
        return _judge_as(judged, Kind.FREQUENCY_RESPONSE, f"{lines}, with phases and without a force")
    why = f"{lines}: these are spectra, not frequency responses"
    return _judge_as(judged, Kind.NOT_USED, f"{why}; export the ratio of response and force, and name it H")


def _is_cycled(judged: JudgedTable) -> bool:
    """Whether a table of one force and one displacement contains slow cycles of many rows each."""
    from scipy.signal import find_peaks

    responses, forces = judged.of_role(Role.RESPONSE), judged.of_role(Role.FORCE)
    quantities = [judged.columns[column.name].quantity for column in (*responses, *forces)]
    if quantities != ["displacement", "force"] or judged.settings:
        return False
    moved = responses[0].values.real
    turns = find_peaks(moved, prominence=PROMINENT * max(float(np.ptp(moved)), 1e-300))[0]
    return 2 <= len(turns) <= len(moved) / ROWS_OF_CYCLE


def _find_imposed_displacement(judged: JudgedTable, mask: np.ndarray) -> str:
    """Evidence that the displacement is imposed and the force is its response; empty if the force is the drive."""
    displacements = [
        column for column in judged.of_role(Role.RESPONSE) if judged.columns[column.name].quantity == "displacement"
    ]
    forces = judged.of_role(Role.FORCE)
    if len(displacements) != 1 or len(forces) != 1:
        return ""
    moved, answer = (np.asarray(column.values.real[mask]) for column in (displacements[0], forces[0]))
    moved, answer = moved - moved.mean(), answer - answer.mean()
    of_motion, of_force = distortion(moved), distortion(answer)
    if of_force < DISTORTED or of_force < 2 * of_motion or not turns_with(moved, answer):
        return ""
    return (
        f"the force is less harmonic ({100 * of_force:.1f} % outside its fundamental) than the displacement, and "
        "reverses with it"
    )


def _find_unsteady_cycles(judged: JudgedTable, mask: np.ndarray) -> str:
    """Evidence of an imposed displacement in cycles with pauses or several amplitudes; empty if there is none.

    The force of a dashpot is largest between the turning points: only its harmonics show that it is not the drive.
    """
    if not _is_cycled(judged):
        return ""
    moved, answer = (judged.of_role(role)[0].values.real[mask] for role in (Role.RESPONSE, Role.FORCE))
    moved, answer = moved - moved.mean(), answer - answer.mean()
    of_motion, of_force = distortion(moved), distortion(answer)
    if find_strongest_line(moved)[1] < IN_LINES or of_force < max(DISTORTED, MUCH_LESS_HARMONIC * of_motion):
        return ""
    return (
        f"the displacement is cyclic, with {100 * of_motion:.1g} % outside its fundamental; of the force it is "
        f"{100 * of_force:.1f} %"
    )


def is_unnamed(guess: Recognised) -> bool:
    """Whether neither the unit nor the name of a channel states that it is a motion or a force."""
    return guess.quantity in {"", "voltage"} or guess.evidence.startswith(OF_FILE)


def list_unnamed_channels(judged: JudgedTable) -> list[Column]:
    """Responses of a table without a force, if the quantity of none is stated; else empty."""
    columns = judged.of_role(Role.RESPONSE)
    unnamed = [column for column in columns if is_unnamed(judged.columns[column.name])]
    return [] if judged.of_role(Role.FORCE) or len(unnamed) < len(columns) else columns


def _judge_time(judged: JudgedTable) -> JudgedTable:
    """Judge a table of time histories, from those of the first series."""
    samples = len(judged.table.columns[0].values)
    if samples < WINDOWS:
        return _judge_as(judged, Kind.NOT_USED, f"it has {samples} rows, but a time history needs {WINDOWS} or more")
    mask = judged.mask(judged.rows()[0])
    quantities = {judged.columns[column.name].quantity for column in judged.of_role(Role.RESPONSE)}
    forces = judged.of_role(Role.FORCE)
    words = set(name_words(make_file_stem(judged.table.file.path.name))) | {
        word for column in judged.table.columns for word in name_words(judged.table.short_name(column))
    }
    if forces and "displacement" in quantities and "acceleration" not in quantities:
        named = sorted(words & LOOP_WORDS)
        if named or judged.settings:
            return _judge_as(
                judged, Kind.LOOP, f'called "{named[0]}"' if named else "its settings are constant in blocks"
            )
        if imposed := _find_imposed_displacement(judged, mask):
            return _judge_as(judged, Kind.LOOP, imposed)
    responses = [column for column in judged.of_role(Role.RESPONSE) if judged.columns[column.name].quantity in MOTIONS]
    responses = responses or judged.of_role(Role.RESPONSE) or forces
    histories = [judge_history(np.asarray(column.values.real[mask])) for column in responses]
    kinds = [history.kind for history in histories]
    pulse = not forces or judge_history(np.asarray(forces[0].values.real[mask])).kind in {"pulse", "decay"}
    kind = max(dict.fromkeys(kinds), key=kinds.count)  # of equally frequent kinds the first; a set has no order
    evidence = histories[kinds.index(kind)].evidence
    if kind in {"decay", "pulse"} and pulse:
        return _judge_as(judged, Kind.RING_DOWN, evidence)
    if kind == "steady state" and (forces or len(list_unnamed_channels(judged)) > 1):
        return _judge_as(judged, Kind.STEADY_STATE, evidence)
    if cycled := _find_unsteady_cycles(judged, mask):
        return _judge_as(judged, Kind.LOOP, cycled)
    return _judge_as(judged, Kind.RECORD, evidence)
