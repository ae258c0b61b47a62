"""Conversion of amplitudes in decibels to linear amplitudes when a file is read."""

import re
from dataclasses import replace

import numpy as np

from correlation.file.column import Column
from correlation.file.unit_label import names_no_unit, read_unit

#: "tip (dB re 1 m/N)", "FRF_dB", "dB(1e-6 m/s2)", "dBg" or "decibels": attached unit, reference and its unit.
DECIBEL = re.compile(
    r"(?<![a-z])(?:decibels?|db(?P<attached>g|n|[mu]?v|m|a|u|fs|spl|))(?![a-z])[\s:,]*"
    r"(?:[(\[](?=\s*(?:re|\d)))?\s*(?:(?:relative|rel|ref|re)\.?\s*(?:to\s+)?)?"
    r"(?P<reference>\d+(?:\.\d*)?(?:e[+-]?\d+)?)?\s*(?P<unit>(?:[^()\[\]]|\([^()]*\))*)",
    re.IGNORECASE,
)
#: Units that are attached to decibels of motions and forces; dBV, dBm, dBA and the like are not converted.
ATTACHED = {"g": "g_n", "n": "N"}
#: Words of a power, whose decibels are ten times a logarithm and not those of an amplitude.
POWER = re.compile(r"psd|power|auto|cross|energy|densit", re.IGNORECASE)
#: Fact of a column that was in decibels.
SCALE = "decibels"


def read_decibels(column: Column) -> Column:
    r"""Amplitudes :math:`x = x_0\,10^{L / 20}` of a column of decibels L; any other column is returned unchanged.

    Parameters
    ----------
    column
        Column of the file, with a label such as "tip (dB re 1 m/N)"; without a reference :math:`x_0` is 1.
    """
    label = column.label or " ".join([column.name, column.unit_label])
    match = DECIBEL.search(label)
    if match is None or POWER.search(label) or column.words or np.iscomplexobj(column.values):
        return column
    attached, label_unit = (match["attached"] or "").lower(), match["unit"].strip()
    if attached and attached not in ATTACHED:
        return replace(column, unit="", unit_label=f"dB{match['attached']}")
    unit = ATTACHED.get(attached) or read_unit(label_unit)
    reference = float(match["reference"] or 1.0)
    with np.errstate(over="ignore"):
        values = reference * 10 ** (column.values / 20)
    unknown = label_unit if match["reference"] and not unit and not names_no_unit(label_unit) else ""
    return replace(column, values=values, unit=unit, unit_label=unknown, facts={**column.facts, SCALE: label.strip()})
