"""Abscissas in the first column of an array, if neither name nor unit states their quantity."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from correlation.file.arrays.first_column import rises_evenly
from correlation.file.column import Column
from study.campaign.column_role import Recognised, Role
from study.campaign.table import MeasuredTable

#: Evidence of a column that may be a time or a frequency.
EITHER = "it rises in equal steps, like a time or a frequency"
INDEX = re.compile(r"[(\[][\d:,]+[)\]]$")


def recognise_first_columns(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Recognise times and frequencies in the first column of an array: columns that rise in equal steps.

    In an array of complex numbers the column is a frequency, in one with a single channel of both signs a time. With
    several channels in the array, such as a real and an imaginary part, it may be either.

    Parameters
    ----------
    table
        Table.
    columns
        Judgement on each column without its table.
    """
    result = dict(columns)
    for column in table.columns:
        guess = columns[column.name]
        over = [one for one in table.columns if one.abscissa == column.name]
        if guess.role in {Role.TIME, Role.FREQUENCY} or guess.unit or not rises_evenly(column):
            continue
        if over and any(np.iscomplexobj(one.values) for one in over):
            why = "the first column of an array of complex numbers, in equal steps, and no unit in the file: Hz assumed"
            result[column.name] = Recognised(role=Role.FREQUENCY, unit="Hz", evidence=why, assumed=True)
        elif over and _is_alone(column, over) and all(_has_both_signs(one.values) for one in over):
            why = "the first column of an array, in equal steps, and no unit in the file: s assumed"
            result[column.name] = Recognised(role=Role.TIME, unit="s", evidence=why, assumed=True)
        elif over or guess.role in {Role.RESPONSE, Role.OTHER}:
            result[column.name] = replace(guess, role=Role.OTHER, evidence=EITHER)
    return result


def _is_alone(first: Column, over: Sequence[Column]) -> bool:
    """Whether each array has one column over the first column, or that is a separate cell of a cell array."""
    return first.name.endswith("}") or max(Counter(INDEX.sub("", one.name) for one in over).values()) == 1


def _has_both_signs(values: np.ndarray) -> bool:
    return bool((values.real > 0).any() and (values.real < 0).any())
