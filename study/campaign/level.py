"""Levels of runs: from names, scalars of the file or measured forces, else asked of the user."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement_unit import find_si_factor
from correlation.campaign.passes import find_passes, number_stated_passes
from correlation.data_quality.missing_level import find_common_factors, format_factors
from correlation.file.quantity import OF_UNIT
from correlation.file.unit_label import find_suffix
from study.campaign.column_role import name_words
from study.campaign.draft import ManifestDraft
from study.campaign.question import Marked
from study.campaign.run_name import find_levels_in_name, read_level
from study.campaign.set_point import HELD
from study.campaign.table import MeasuredTable, make_file_stem
from study.campaign.table_kind import JudgedTable

Series = Float[NDArray[np.float64], " n"]
Whole = Int[NDArray[np.int64], " n"]

#: Words in the name of a scalar that is a level.
LEVEL_NUMBERS = {"level", "levels", "force", "forces", "setpoint", "amplitude", "amplitudes", "loads", "stufe"}
WHY = "the file contains neither force nor level"
#: Significant digits of the median force of a sweep.
DIGITS = 2


def find_named_levels(table: MeasuredTable) -> list[re.Match[str]]:
    """Levels in the names of a set of channels, a group and a file, the most likely first."""
    whole = f"{make_file_stem(table.file.path.name)} {table.path}"
    return [*find_levels_in_name(table.of_set), *find_levels_in_name(whole)]


def find_level_in_name(judged: JudgedTable) -> tuple[float | None, str]:
    """Level in the name of a table in N, V, g_n, m/s^2 or percent, and its text, such as "10N"; None without one."""
    match = next(iter(find_named_levels(judged.table)), None)
    return (read_level(match)[0], match[0]) if match else (None, "")


def find_force_in_name(judged: JudgedTable, force: str) -> tuple[float | None, str]:
    """Level in the name of a run in the unit of its force, and its text; None if they are not both forces.

    Parameters
    ----------
    judged
        Table.
    force
        Column of the force.
    """
    unit = judged.columns[force].unit
    if OF_UNIT.get(unit) != "force":
        return None, ""
    forces = [
        (value, match[0]) for match in find_named_levels(judged.table) if (value := _read_newtons(match)) is not None
    ]
    return (float(f"{forces[0][0] / find_si_factor(unit, 'N'):.12g}"), forces[0][1]) if forces else (None, "")


def find_named_force(table: MeasuredTable) -> float | None:
    """Level in the names of a table, if it is a force [N]; else None."""
    return next((value for match in find_named_levels(table) if (value := _read_newtons(match)) is not None), None)


def _read_newtons(match: re.Match[str]) -> float | None:
    value, unit = read_level(match)
    return value if unit == "N" else None


def find_level_beside_columns(judged: JudgedTable, size: Series | float | None) -> dict[str, Any]:
    """Level stated by a scalar of the table, if the measured force is near it or there is none; else empty.

    Parameters
    ----------
    judged
        Table.
    size
        Amplitude or amplitudes of the force, shape (n,); None without a force.
    """
    for name, number in judged.table.scalars.items():
        if _is_level(name, number) and (size is None or _is_near(size, number)):
            return {"level": Marked(value=number, assumed=f'the scalar "{name}" of the file')}
    return {}


def find_unit_of_number(table: MeasuredTable) -> str:
    """Unit of the scalar of a table that is a level, from its name; empty without one."""
    named = next((name for name, number in table.scalars.items() if _is_level(name, number)), "")
    return find_suffix(named)[1]


def _is_level(name: str, number: float) -> bool:
    return bool(set(name_words(name)) & LEVEL_NUMBERS) and number > 0


def _is_near(size: Series | float, level: float) -> bool:
    return bool(abs(float(np.nanmedian(size)) - level) < HELD * level)


def find_named_set_point(judged: JudgedTable, force: str, size: Series | float) -> dict[str, Any]:
    """Level in the name of a run, if its measured force is near it; else empty.

    Parameters
    ----------
    judged
        Table.
    force, size
        Column of the force, and its amplitude or amplitudes, shape (n,).
    """
    value, _ = find_force_in_name(judged, force)
    if value is None:
        return {}
    why = "the level in its name, close to its force"
    return {"level": Marked(value=value, assumed=why)} if _is_near(size, value) else {}


def ask_levels(
    draft: ManifestDraft, label: str, frequency: Series, sweep: Whole | None, sizes: Sequence[Series]
) -> dict[str, Any]:
    """Ask for the level or levels of a run whose file has neither force nor level.

    Parameters
    ----------
    draft
        Draft, for questions.
    label
        Name of the table.
    frequency
        Frequencies in the order of measurement, shape (n,).
    sweep
        Stated sweeps (+1, -1, 0), shape (n,); None to derive them from the frequencies.
    sizes
        Moduli of each response, shape (n,) each.
    """
    of_pass = number_passes(frequency, sweep)
    factors = find_common_factors(_arrange_by_pass(frequency, of_pass, sizes))
    n = 1 if factors is None else int(of_pass.max()) + 1
    text, why = f"What is the level of {label} (a number)?", WHY
    if factors is not None:
        text = f"What are the levels of the {n} sweeps of {label} ({n} numbers, or one for all)?"
        listed = format_factors(factors)
        why = f"{WHY}, and its sweeps differ by factors {listed}: levels, not repeats; give levels = [...]"
    answer = draft.ask(text, "1.0", why)
    numbers = _read_numbers(str(answer.value))
    if n > 1 and len(numbers) == n:
        return {"levels": numbers}
    return {"level": Marked(value=(numbers or [1.0])[0], assumed=answer.assumed)}


def find_levels_of_force(frequency: Series, sweep: Whole | None, force: Series) -> dict[str, Any]:
    """Levels of sweeps whose measured forces differ by common factors; empty if all sweeps have one level."""
    of_pass = number_passes(frequency, sweep)
    if find_common_factors(_arrange_by_pass(frequency, of_pass, [force])) is None:
        return {}
    medians = [float(f"{np.nanmedian(force[of_pass == one]):.{DIGITS}g}") for one in range(int(of_pass.max()) + 1)]
    return {"levels": Marked(value=medians, assumed="the median force of each sweep")}


def number_passes(frequency: Series, sweep: Whole | None) -> Whole:
    """Number of the pass, from 0, of each row, shape (n,); parameters as in `ask_levels`."""
    return find_passes(frequency)[1] if sweep is None else number_stated_passes(frequency, sweep)


def _arrange_by_pass(frequency: Series, of_pass: Whole, sizes: Sequence[Series]) -> Float[NDArray[np.float64], "m p"]:
    """Moduli by frequency and response (rows) and by pass (columns); NaN if a pass lacks a value."""
    rising, place = np.unique(frequency, return_inverse=True)
    table = np.full((len(sizes), len(rising), int(of_pass.max()) + 1), np.nan)
    for own, size in zip(table, sizes, strict=True):
        own[place, of_pass] = size
    return table.reshape(-1, table.shape[-1])


def _read_numbers(text: str) -> list[float]:
    """Numbers of an answer such as "1, 3, 10" or "2,5 N"; none if its first word is not a number."""
    words = text.replace(", ", " ").replace("[", " ").replace("]", " ").replace(",", ".").split()
    try:
        return [float(word) for word in words[:1]] + [float(word) for word in words[1:] if word[:1].isdigit()]
    except ValueError:
        return []
