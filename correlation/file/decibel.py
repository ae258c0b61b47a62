"""Amplitudes in decibels are made linear where a file is read, so that nothing else need know of them."""

import re
from dataclasses import replace

import numpy as np

from correlation.file.column import Column
from correlation.file.unit_label import unit_text

#: "tip (dB re 1 m/N)", "FRF_dB" or "decibels", with what follows: the reference and its unit.
DECIBEL = re.compile(
    r"(?<![a-z])d(?:b|ecibels?)(?![a-z])[\s:,]*(?:\(?\s*(?:relative|rel|ref|re)\.?\s*(?:to\s+)?)?"
    r"(?P<reference>\d+(?:\.\d*)?(?:e[+-]?\d+)?)?\s*(?P<unit>(?:[^()\[\]]|\([^()]*\))*)",
    re.IGNORECASE,
)
#: Decibels of a power are ten logarithms, and no amplitude.
POWER = re.compile(r"psd|power|auto|cross|energy|densit", re.IGNORECASE)
#: Fact of a column that was in decibels.
SCALE = "decibels"


def read_decibels(column: Column) -> Column:
    r"""The amplitudes :math:`x = x_0\,10^{L / 20}` of a column of decibels L; any other column as it is.

    Parameters
    ----------
    column
        As the file has it, its label such as "tip (dB re 1 m/N)"; without a reference :math:`x_0` is 1.
    """
    label = column.label or column.name
    found = DECIBEL.search(label)
    if found is None or POWER.search(label) or column.words or np.iscomplexobj(column.values):
        return column
    reference = float(found["reference"] or 1.0)
    with np.errstate(over="ignore"):
        values = reference * 10 ** (column.values / 20)
    return replace(column, values=values, unit=unit_text(found["unit"]), facts={**column.facts, SCALE: label})
