"""Tables of natural frequencies, one row per mode."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from correlation.file.column import Column
from study.campaign.column_role import Recognised, Role, name_words
from study.campaign.table import MeasuredTable

MODE_WORDS = {"mode", "modes", "eigenmode", "eigenform"}
DAMPING_WORDS = {"damping", "zeta", "xi", "dämpfung", "daempfung", "dämpfungsgrad"}
#: Units of a damping ratio; a column in another unit may be a decay rate.
RATIO_UNITS = {"", "percent"}
#: Roles of columns in a table of modes; columns of other roles are measured over the frequency.
BESIDE = {Role.FREQUENCY, Role.ORDER, Role.REPEAT, Role.OTHER, Role.FOREIGN, Role.COHERENCE, Role.SENSOR}


def recognise_modes(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Recognise numbers, names and damping of modes in a table of natural frequencies; empty for other tables.

    Parameters
    ----------
    table
        Table.
    columns
        Judgement on each column.
    """
    frequency = next((one for one in table.columns if columns[one.name].role is Role.FREQUENCY), None)
    if frequency is None or {guess.role for guess in columns.values()} - BESIDE:
        return {}
    others = [one for one in table.columns if one is not frequency]
    words = {one.name: set(name_words(table.short_name(one))) for one in others}
    count = next((one for one in others if _counts(one)), None)
    damping = next((one for one in others if words[one.name] & DAMPING_WORDS and one.unit in RATIO_UNITS), None)
    names = next((one for one in others if len(set(one.words)) == len(one.values)), None)
    called = count is not None and words[count.name] & MODE_WORDS
    steps = np.diff(frequency.values)
    # Lines of a spectrum may be numbered as well; they have equal steps.
    alone = count is not None and len(others) == 1 + (names is not None) and not np.allclose(steps, steps[0])
    if not (called or alone or (damping is not None and bool((steps > 0).all()))):
        return {}
    roles = [(count, Role.MODE, "it counts the rows"), (names, Role.MODE, "its words differ from row to row")]
    roles += [(damping, Role.DAMPING, "by name")]
    return {
        one.name: replace(columns[one.name], role=role, evidence=why) for one, role, why in roles if one is not None
    }


def _counts(column: Column) -> bool:
    """Whether values are whole numbers that rise by one from row to row."""
    values = column.values
    return not (column.words or np.iscomplexobj(values)) and bool(values[0] % 1 == 0 and (np.diff(values) == 1).all())
