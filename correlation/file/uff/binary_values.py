"""Binary values of a dataset 58b: decoding, and the end of the values in the file.

The header has the number of values n, their type, and the length in bytes, which is wrong in the files of some
programs. The length is therefore computed from n. Uneven abscissas beside values in double precision have 4 bytes by
the FORTRAN statements of the format, and 8 in the files of most programs; the right length is that after which a line
of -1 follows.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.errors import CampaignError

END_MARK = re.compile(rb"(?:\r?\n)?[ \t]{0,4}-1[ \t]*(?:\r|\n|\Z)")
ORDERS = {1: "<", 2: ">"}
ORDER_NAMES = {"<": "little endian", ">": "big endian"}
#: Binary formats of numbers other than IEEE 754.
OLD_FORMATS = {1: "DEC VMS", 3: "IBM 5/370"}
SINGLE, COMPLEX = {2, 5}, {5, 6}


@dataclass(frozen=True, kw_only=True, eq=False)
class BinaryValues:
    """Decoded values of a dataset.

    Parameters
    ----------
    abscissa
        Uneven abscissa, shape (n,); None if it is even.
    ordinate
        Real or complex values, shape (n,).
    end
        Offset of the end of the values in the file.
    """

    abscissa: NDArray[np.float64] | None
    ordinate: NDArray[Any]
    end: int


def read_binary_values(
    error: Callable[[int, str], CampaignError], identifier: str, record: str, data: bytes, start: int
) -> BinaryValues:
    """Read the values after the header of a binary dataset.

    Parameters
    ----------
    error
        Function that makes an error of the dataset from the index of a line, -1 for the identifier, and a sentence.
    identifier
        Rest of the identifier line: byte order, format of numbers, lines of header, number of bytes.
    record
        Seventh line of the header: type, number of values, spacing; empty for a dataset of another type, whose values
        are skipped.
    data, start
        Bytes of the file, and offset of the values.

    Raises
    ------
    CampaignError
        The values are cut, their number does not fit, or their byte order is not that in the header.
    """
    numbers = [int(field) for field in re.findall(r"-?\d+", identifier)[:4]]
    fields = re.findall(r"-?\d+", record[:30])
    if len(numbers) < 4 or (record and len(fields) < 3):
        raise error(-1, f'"{identifier.strip()[:60]}" is not a description of binary values; export the file again')
    order, number_format, _, n_byte = numbers
    if not record:
        return _skip(error, data, start, n_byte)
    if order not in ORDERS:
        raise error(-1, f"byte order {order} is unknown; 1 is little endian, 2 is big endian")
    if number_format not in {0, 2}:
        name = OLD_FORMATS.get(number_format, "unknown")
        raise error(-1, f"format {number_format} of binary numbers ({name}) is not read; export IEEE 754 or text")
    kind, count, even = (int(field) for field in (fields[0], fields[1], fields[2]))
    if kind not in SINGLE | {4, 6} or even not in {0, 1} or count < 0:
        raise error(6, f'"{record.strip()[:60]}": type of values must be 2, 4, 5 or 6, spacing 0 or 1')
    layouts = _list_layouts(kind, even == 1, ORDERS[order])
    for number, layout in enumerate(sorted(layouts, key=lambda layout: layout.itemsize * count != n_byte)):
        end = start + layout.itemsize * count
        # The end of the file is accepted for the first layout only: a cut file may end as one of a shorter layout.
        is_last = number == 0 and end <= len(data) and not data[end:].strip()
        if is_last or END_MARK.match(data, end):
            return _decode(error, layout, data, start, end, kind in COMPLEX)
    needed = layouts[0].itemsize * count
    left = len(data) - start
    if left < needed:
        raise error(6, f"{count} values need {needed} bytes, the file ends after {left}; it is cut: copy it again")
    raise error(
        6,
        f"{count} values need {needed} bytes, and no line of -1 follows them (the header says {n_byte} bytes); "
        "the count is wrong or bytes are lost: export the file again",
    )


def _list_layouts(kind: int, even: bool, order: str) -> list[np.dtype[Any]]:
    """Possible storage formats of a value, the most common first."""
    parts = 2 if kind in COMPLEX else 1
    single, double = f"{order}f4", f"{order}f8"
    # pyuff writes values of single-precision types in double precision.
    sizes = [(single, single), (double, double)] if kind in SINGLE else [(double, double), (single, double)]
    return list(
        dict.fromkeys(
            np.dtype([("y", ordinate, (parts,))] if even else [("x", abscissa), ("y", ordinate, (parts,))])
            for abscissa, ordinate in sizes
        )
    )


def _decode(
    error: Callable[[int, str], CampaignError],
    layout: np.dtype[Any],
    data: bytes,
    start: int,
    end: int,
    has_phase: bool,
) -> BinaryValues:
    table = np.frombuffer(data, layout, (end - start) // layout.itemsize, start)
    order = ">" if layout["y"].base.str.startswith(">") else "<"
    if _is_swapped(table["y"].reshape(-1)):
        other = ORDER_NAMES["<" if order == ">" else ">"]
        raise error(
            -1,
            f"says that its values are {ORDER_NAMES[order]}, but they only make sense as {other}; correct the header",
        )
    parts = table["y"].astype(np.float64)
    ordinate = parts.view(np.complex128).reshape(-1) if has_phase else parts.reshape(-1)
    abscissa = table["x"].astype(np.float64) if "x" in (layout.names or ()) else None
    return BinaryValues(abscissa=abscissa, ordinate=ordinate, end=end)


def _is_swapped(values: NDArray[Any]) -> bool:
    """Whether values are implausible as they are, but plausible with their bytes in the opposite order."""
    return _compute_absurd_share(values) > 0.2 and _compute_absurd_share(values.byteswap()) < 0.01


def _compute_absurd_share(values: NDArray[Any]) -> float:
    """Fraction of non-zero values with an implausible magnitude."""
    size = np.abs(values[values != 0].astype(np.float64))
    return float(np.mean(~((size > 1e-18) & (size < 1e18)))) if len(size) else 0.0


def _skip(error: Callable[[int, str], CampaignError], data: bytes, start: int, n_byte: int) -> BinaryValues:
    """Skip the values of a binary dataset of another type."""
    end = start + n_byte
    if n_byte < 0 or end > len(data) or not (END_MARK.match(data, end) or not data[end:].strip()):
        raise error(-1, f"does not have the stated {n_byte} bytes of binary values; export the file again")
    return BinaryValues(abscissa=None, ordinate=np.zeros(0), end=end)
