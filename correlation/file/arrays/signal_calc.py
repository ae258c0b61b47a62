"""Units of the arrays of SignalCalc (Data Physics) from texts "Signal H1_2", "Real/Imag g / N" in a list `DP_Info`."""

import itertools
import re
from dataclasses import replace

from correlation.file.column import Column, MeasuredFile
from correlation.file.unit_label import read_unit

INFO = "DP_Info"
SIGNAL = re.compile(r"Signal (\w+)")
KIND = re.compile(r"(?:Real EU|Real/Imag|Mag EU) (.+)")
#: Product in brackets, which older versions also write for the ratio of a response to its reference.
PAIR = re.compile(r"\((.+)\)\((.+)\)")
FIRST, VALUES = "(:,1)", "(:,2)"


def read_signal_units(file: MeasuredFile) -> MeasuredFile:
    """Set the units of columns from the list; two units in brackets are a ratio for a frequency response H.

    Blocks W repeat the blocks X with a window and are left out beside them.

    Parameters
    ----------
    file
        Measured file.
    """
    info = next((column for column in file.columns if column.name == INFO and column.words), None)
    if info is None:
        return file
    texts = [info.words[int(code)].strip(" \0") for code in info.values]
    labels: dict[str, str] = {}
    for text, below in itertools.pairwise(texts):
        signal, kind = SIGNAL.fullmatch(text), KIND.fullmatch(below)
        if signal and kind:
            labels[signal[1] + VALUES] = _format_ratio(kind[1]) if signal[1].startswith("H") else kind[1]

    def labelled(column: Column) -> Column:
        label = "" if column.unit else labels.get(column.name, "")
        return replace(column, unit=read_unit(label), unit_label=label) if label else column

    again = {f"W{name[1:]}" for name in labels if name.startswith("X")}
    again |= {name.replace(VALUES, FIRST) for name in again}
    left_out = dict.fromkeys(again & {*labels}, "not read: a block under a window, which stands there without it")
    columns = tuple(labelled(column) for column in file.columns if column.name not in again)
    return replace(file, columns=columns, facts={**file.facts, **left_out})


def _format_ratio(label: str) -> str:
    match = PAIR.fullmatch(label)
    return f"{match[1]}/{match[2]}" if match else label
