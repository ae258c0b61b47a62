"""Writer of universal files: datasets 151, 164, 15 and 58 or 58b, in double precision."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.dataset_58 import AXES, FUNCTIONS

#: Data types of abscissas.
DATA_TYPES = {"time": 17, "frequency": 18}
LENGTH_OF_ID, LENGTH_OF_NAME = 80, 10


def write_uff(measured: MeasuredFile, path: Path, *, binary: bool = False) -> None:
    """Write title, nodes and all columns that have an abscissa.

    Parameters
    ----------
    measured
        Content to write. Values have 12 digits as text and all digits as binary; abscissas have 6 digits as text.
    path
        Path of the file.
    binary
        Whether values are binary (58b, little endian), not text.

    Raises
    ------
    CampaignError
        The abscissa of a column is not among the columns, or has another length.
    """
    blocks = [_format_title(measured.title or measured.path.stem), _format_units()]
    if measured.nodes:
        blocks.append(_format_nodes(measured))
    blocks.extend(
        _format_function(column, measured.column(column.abscissa), measured.path.name, binary)
        for column in measured.columns
        if column.abscissa is not None
    )
    path.write_bytes(b"".join(blocks))


def _format_dataset(identifier: str, lines: list[str], values: bytes = b"") -> bytes:
    head = "".join(f"{line}\n" for line in ("    -1", identifier, *lines))
    return head.encode("utf-8") + values + b"    -1\n"


def _format_title(title: str) -> bytes:
    text = [title[:LENGTH_OF_ID], "NONE", "stickslip", "", "", "stickslip", ""]
    return _format_dataset("   151", text)


def _format_units() -> bytes:
    factor = f"{1.0:25.16E}".replace("E", "D")
    return _format_dataset("   164", [f"{1:10d}{'SI':<20s}{2:10d}", factor * 3, f"{0.0:25.16E}".replace("E", "D")])


def _format_nodes(measured: MeasuredFile) -> bytes:
    lines = [
        f"{number:10d}{0:10d}{0:10d}{0:10d}" + "".join(f"{value:13.5E}" for value in place)
        for number, place in sorted(measured.nodes.items())
    ]
    return _format_dataset("    15", lines)


def _format_function(column: Column, abscissa: Column, file: str, binary: bool) -> bytes:
    values, x = column.values, abscissa.values
    if len(values) != len(x) or not len(values):
        raise CampaignError(
            f'{file}: "{column.name}" has {len(values)} values, its abscissa "{abscissa.name}" has {len(x)}'
        )
    step = _find_even_step(x)
    parts = [values.real, values.imag] if np.iscomplexobj(values) else [values]
    table = np.stack([*([] if step is not None else [x]), *parts], axis=1)
    facts = [column.facts.get(f"line {number}", "NONE")[:LENGTH_OF_ID] for number in range(1, 6)]
    kind = FUNCTIONS.index(column.function) if column.function in FUNCTIONS else 0
    lines = [
        *facts,
        f"{kind:5d}{0:10d}{0:5d}{0:10d} {_point(column.response)} {_point(column.reference)}",
        f"{6 if len(parts) == 2 else 4:10d}{len(values):10d}{step is not None:10d}"
        f"{0.0 if step is None else x[0]:13.5E}{step or 0.0:13.5E}{0.0:13.5E}",
        _format_axis(DATA_TYPES.get(abscissa.name.partition(" (")[0], 0), abscissa.name, abscissa.unit),
        _format_axis(0, column.facts.get("label", "NONE"), column.unit),
        _format_axis(0, "NONE", "NONE"),
        _format_axis(0, "NONE", "NONE"),
    ]
    if binary:
        payload = table.astype("<f8").tobytes()
        identifier = f"    58b{1:6d}{2:6d}{11:12d}{len(payload):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
        return _format_dataset(identifier, lines, payload)
    return _format_dataset("    58", lines, "".join(_format_values(table, step is not None)).encode("ascii"))


def _find_even_step(x: Float[NDArray[np.float64], " n"]) -> float | None:
    """Step of an abscissa that six digits describe exactly; None if it has to be written point by point."""
    if len(x) < 2:
        return None
    first, step = float(f"{x[0]:.5E}"), float(f"{x[1] - x[0]:.5E}")
    return step if step > 0 and np.array_equal(first + step * np.arange(len(x)), x) else None


def _format_values(table: Float[NDArray[np.float64], "n k"], even: bool) -> Iterator[str]:
    """Yield lines of values: four per line if the abscissa is even, else abscissas of six digits before the values."""
    if even:
        numbers = table.reshape(-1)
        for start in range(0, len(numbers), 4):
            yield "".join(f"{value:20.11E}" for value in numbers[start : start + 4]) + "\n"
        return
    per_line = 2 if table.shape[1] == 2 else 1
    for start in range(0, len(table), per_line):
        rows = table[start : start + per_line]
        yield "".join(f"{row[0]:13.5E}" + "".join(f"{value:20.11E}" for value in row[1:]) for row in rows) + "\n"


def _point(point: Point | None) -> str:
    if point is None:
        return f"{'NONE':<10s}{0:10d}{0:4d}"
    axis = AXES.index(point.direction.lstrip("+-"))
    sign = -1 if point.direction.startswith("-") else 1
    return f"{(point.name or 'NONE')[:LENGTH_OF_NAME]:<10s}{point.node or 0:10d}{sign * axis:4d}"


def _format_axis(kind: int, label: str, unit: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {label[:20]:<20s} {(unit or 'NONE')[:20]:<20s}"
