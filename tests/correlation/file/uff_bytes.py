"""Universal files byte by byte from the description of the format, independent of the product's writer."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SINGLE_REAL, DOUBLE_REAL, SINGLE_COMPLEX, DOUBLE_COMPLEX = 2, 4, 5, 6


def fortran(value: float, width: int, digits: int) -> str:
    """A number in the format Ew.d of FORTRAN: 0.12346E+03 in columns of width w."""
    return f"{value:{width}.{digits}E}"


@dataclass(frozen=True, kw_only=True)
class Function:
    """What a dataset 58 has in its header and values."""

    kind: int
    x: NDArray[np.float64]
    y: NDArray[np.complex128] | NDArray[np.float64]
    even: bool
    function: int = 4
    response: tuple[str, int, int] = ("NONE", 12, 3)
    reference: tuple[str, int, int] = ("NONE", 1, -3)
    axes: Sequence[tuple[int, str, str]] = (
        (18, "NONE", "NONE"), (12, "NONE", "NONE"), (13, "NONE", "NONE"), (0, "NONE", "NONE"),
    )  # fmt: skip

    @property
    def interleaved(self) -> list[float]:
        """Numbers in the order of the file: abscissa unless even, real part, imaginary part."""
        numbers: list[float] = []
        for x, y in zip(self.x, self.y, strict=True):
            numbers += [] if self.even else [float(x)]
            numbers += [y.real, y.imag] if self.kind in {SINGLE_COMPLEX, DOUBLE_COMPLEX} else [float(y.real)]
        return numbers

    @property
    def header(self) -> list[str]:
        """The eleven lines between the identifier and the values."""
        points = "".join(
            f" {name:<10.10s}{node:10d}{direction:4d}" for name, node, direction in (self.response, self.reference)
        )
        step = self.x[1] - self.x[0] if self.even else 0.0
        return [
            "id one", "NONE", "18-Apr-16 13:49:58", "NONE", "NONE",
            f"{self.function:5d}{0:10d}{0:5d}{0:10d}{points}",
            f"{self.kind:10d}{len(self.x):10d}{int(self.even):10d}"
            + fortran(self.x[0] if self.even else 0.0, 13, 5) + fortran(step, 13, 5) + fortran(0.0, 13, 5),
            *[f"{kind:10d}{0:5d}{0:5d}{0:5d} {label:<20s} {unit:<20s}" for kind, label, unit in self.axes],
        ]  # fmt: skip

    @property
    def value_lines(self) -> list[str]:
        """Values as text: 6E13.5, 4E20.12, 2(E13.5,E20.12) or E13.5,2E20.12."""
        if self.kind in {SINGLE_REAL, SINGLE_COMPLEX}:
            widths = [(13, 5)] * 6
        elif self.even:
            widths = [(20, 12)] * 4
        elif self.kind == DOUBLE_REAL:
            widths = [(13, 5), (20, 12)] * 2
        else:
            widths = [(13, 5), (20, 12), (20, 12)]
        numbers = self.interleaved
        return [
            "".join(fortran(value, *format_) for value, format_ in zip(numbers[start:], widths, strict=False))
            for start in range(0, len(numbers), len(widths))
        ]

    def text(self) -> bytes:
        """The dataset as text."""
        return lines_to_bytes(["    -1", "    58", *self.header, *self.value_lines, "    -1"])

    def binary(self, order: str, *, single_abscissa: bool = False) -> bytes:
        """The dataset with binary values, little ("<") or big (">") endian."""
        letter = "f" if self.kind in {SINGLE_REAL, SINGLE_COMPLEX} else "d"
        parts = 2 if self.kind in {SINGLE_COMPLEX, DOUBLE_COMPLEX} else 1
        abscissa = "" if self.even else ("f" if single_abscissa else letter)
        payload = struct.pack(order + (abscissa + letter * parts) * len(self.x), *self.interleaved)
        identifier = f"    58b{1 if order == '<' else 2:6d}{2:6d}{11:12d}{len(payload):12d}{0:6d}{0:6d}{0:12d}{0:12d}"
        return lines_to_bytes(["    -1", identifier, *self.header]) + payload + b"    -1\n"


def lines_to_bytes(lines: Sequence[str]) -> bytes:
    """Lines with their ends."""
    return "".join(f"{line}\n" for line in lines).encode("ascii")


def units(code: int, length: float, force: float) -> bytes:
    """Dataset 164 with D exponents."""
    factors = "".join(f"{value:25.17E}".replace("E", "D") for value in (length, force, 1.0))
    return lines_to_bytes(
        ["    -1", "   164", f"{code:10d}{'user':<20s}{2:10d}", factors, f"{0.0:25.17E}".replace("E", "D"), "    -1"]
    )


def nodes(places: Sequence[tuple[int, float, float, float]]) -> bytes:
    """Dataset 15."""
    rows = [
        f"{number:10d}{0:10d}{0:10d}{0:10d}" + "".join(fortran(value, 13, 5) for value in place)
        for number, *place in places
    ]
    return lines_to_bytes(["    -1", "    15", *rows, "    -1"])


def example(kind: int, *, even: bool, count: int = 7) -> Function:
    """A function whose numbers all formats hold: multiples of 1/8, exact with six digits and in single precision."""
    rng = np.random.default_rng(kind + 10 * even)
    x = 10.0 + 0.25 * np.arange(count) if even else 10.0 + np.cumsum(rng.integers(1, 9, count)) / 8
    y = rng.integers(-800, 800, count) / 8 + (1j * rng.integers(-800, 800, count) / 8 if kind > DOUBLE_REAL else 0)
    return Function(kind=kind, x=x, y=y, even=even)
