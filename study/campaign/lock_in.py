"""In-phase and quadrature parts, as in files of lock-in amplifiers."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from study.campaign.column_role import QUADRATURE, ComplexPart, Recognised, Role, name_words
from study.campaign.table import MeasuredTable


def recognise_quadratures(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Recognise X and Y as real and imaginary parts, if the table has frequencies, no Z, and X or Y has both signs.

    Parameters
    ----------
    table
        Table.
    columns
        Judgement on each column.
    """
    result = dict(columns)
    if not any(guess.role is Role.FREQUENCY for guess in columns.values()):
        return result
    parts = [
        column
        for column in table.columns
        if columns[column.name].role is Role.RESPONSE
        and columns[column.name].part is ComplexPart.VALUE
        and not np.iscomplexobj(column.values)
    ]
    words = {column.name: tuple(name_words(table.short_name(column))) for column in parts}
    for real in parts:
        other = tuple("y" if word == "x" else word for word in words[real.name])
        partner = [one for one in parts if "x" in words[real.name] and words[one.name] == other]
        third = tuple("z" if word == "x" else word for word in words[real.name])
        alike = partner and columns[partner[0].name].unit == columns[real.name].unit
        if (
            alike
            and third not in words.values()
            and any((one.values < 0).any() and (one.values > 0).any() for one in (real, partner[0]))
        ):
            why = f'"{real.name}" and "{partner[0].name}" {QUADRATURE}'
            stem = " ".join(word for word in words[real.name] if word != "x")
            for part, column in ((ComplexPart.REAL, real), (ComplexPart.IMAGINARY, partner[0])):
                result[column.name] = replace(columns[column.name], part=part, stem=stem, evidence=why)
    return result
