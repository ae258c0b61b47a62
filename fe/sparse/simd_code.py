"""Machine code for rows of a few numbers that stay in the vector registers of the processor.

The matrix product of a library first copies its operands, which costs as much as the product itself for a dozen
columns. Here the long operand is read once, in the order of memory, while the results stay in registers. Compilers do
not produce such code from loops, so a few operations (`fe.sparse.simd_tile`, `fe.sparse.simd_sum`) are written in the
intermediate representation of LLVM, through numba's intrinsics.

Columns that are processed together are stored as rows of a few numbers side by side. The length of the tuple `lanes` is
the length of these rows, so that machine code is compiled for each length. All addresses are in bytes, as in
`array.ctypes.data`.

References
----------
Goto and van de Geijn, Anatomy of high-performance matrix multiplication, ACM Trans. Math. Softw. 34 (2008) 12: reasons
to keep results in registers.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from llvmlite import ir
from numba.core import cgutils, config, types
from numba.core.codegen import get_host_cpu_features
from numba.extending import intrinsic
from numpy.typing import NDArray

DOUBLE, INTEGER, SHORT = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
SIZE, SHORT_SIZE = 8, 4
#: Number of bytes of a cache line.
LINE = 64
#: Largest number of values in a register.
REGISTER = 8
#: Distance by which a tile is prefetched [byte]; the processor's own prefetching stops at the end of each page.
AHEAD = 4096
#: Largest number of rows of a full tile on any processor.
TALLEST = 8
#: Features of the processor for which machine code is compiled: of this processor, or as set in numba.
SETTINGS: Any = config
HOST: Any = get_host_cpu_features
FEATURES = HOST() if SETTINGS.CPU_FEATURES is None else SETTINGS.CPU_FEATURES
#: Number of rows of a full tile on this processor: the results for sixteen right-hand sides fill half of the 32
#: registers of AVX-512, those for twelve fill three quarters of the 16 smaller registers of AVX2.
ROWS = TALLEST if "+avx512f" in FEATURES else 4
#: Numbers of rows of all tiles, the full tile first; the rest of a supernode is cut into the smaller tiles.
HEIGHTS = tuple(height for height in (8, 4, 2, 1) if height <= ROWS)

#: Numbers of right-hand sides that are processed together; missing ones are filled up with zeros.
LANES = (4, 12, 16, 24)

POSITIONAL = inspect.Parameter.POSITIONAL_OR_KEYWORD
Value = Any
#: One row of right-hand sides, in one or several registers.
Row = list[Value]


def groups(n: int) -> Iterator[tuple[slice, tuple[int, ...]]]:
    """Groups of n right-hand sides that are processed together, each with its tuple of lanes."""
    for first in range(0, n, LANES[-1]):
        some = slice(first, min(first + LANES[-1], n))
        yield some, (0,) * next(item for item in LANES if item >= some.stop - some.start)


class Code:
    """Writer of instructions for rows of `lanes` right-hand sides."""

    def __init__(self, builder: Any, lanes: int) -> None:
        self.builder, self.lanes = builder, lanes
        full, rest = divmod(lanes, REGISTER)
        self.registers = [REGISTER] * full + [rest] * bool(rest)

    def address(self, base: Value, index: Value | int, stride: Value | int) -> Value:
        """Address of an item `index` strides after the base."""
        if isinstance(index, int) and isinstance(stride, int):
            return self.builder.add(base, INTEGER(index * stride))
        index, stride = (INTEGER(item) if isinstance(item, int) else item for item in (index, stride))
        return self.builder.add(base, self.builder.mul(index, stride))

    def number(self, address: Value) -> Value:
        """Number at an address."""
        return self._load(address, DOUBLE, SIZE)

    def numbers(self, address: Value, n: int) -> list[Value]:
        """Numbers side by side, starting at an address."""
        return [self.number(self.address(address, r, SIZE)) for r in range(n)]

    def fetch_rows(self, x: Value, row: Value, first: int, last: int) -> None:
        """Prefetch rows of x whose numbers are at places `first` to `last` of the list at `row`."""
        for index in range(first, last):
            place = self.place(x, row, index)
            for line in range(0, SIZE * self.lanes, LINE):
                self.fetch(place, line)

    def place(self, x: Value, row: Value, index: int) -> Value:
        """Address of the row of x whose number is at place `index` of the list at `row`."""
        number = self.builder.sext(self._load(self.address(row, index, SHORT_SIZE), SHORT, SHORT_SIZE), INTEGER)
        return self.address(x, number, SIZE * self.lanes)

    def row(self, address: Value) -> Row:
        """Row at an address."""
        return [
            self._load(self.address(address, k * REGISTER, SIZE), ir.VectorType(DOUBLE, width), SIZE)
            for k, width in enumerate(self.registers)
        ]

    def store(self, row: Row, address: Value) -> None:
        """Store a row at an address."""
        for k, value in enumerate(row):
            pointer = self.builder.inttoptr(self.address(address, k * REGISTER, SIZE), value.type.as_pointer())
            self.builder.store(value, pointer).align = SIZE

    def zero(self) -> Row:
        """Row of zeros."""
        return [ir.Constant(ir.VectorType(DOUBLE, width), None) for width in self.registers]

    def times(self, factor: Value, row: Row) -> Row:
        """Factor * row."""
        return [self.builder.fmul(self._spread(factor, value), value) for value in row]

    def plus(self, a: Row, b: Row) -> Row:
        """The sum a + b."""
        return [self.builder.fadd(x, y) for x, y in zip(a, b, strict=True)]

    def minus(self, a: Row, b: Row) -> Row:
        """The difference a - b."""
        return [self.builder.fsub(x, y) for x, y in zip(a, b, strict=True)]

    def negative(self, row: Row) -> Row:
        """Negative of a row."""
        return [self.builder.fneg(value) for value in row]

    def plus_times(self, a: Row, factor: Value, row: Row) -> Row:
        """The sum a + factor * row, rounded once."""
        result = []
        for x, y in zip(a, row, strict=True):
            kind = x.type
            signature = ir.FunctionType(kind, [kind] * 3)
            multiply_add = self._intrinsic(signature, f"llvm.fma.v{kind.count}f64")
            result.append(self.builder.call(multiply_add, [self._spread(factor, y), y, x]))
        return result

    def fetch(self, address: Value, ahead: int = AHEAD) -> None:
        """Prefetch the memory `ahead` bytes after an address."""
        byte = ir.IntType(8).as_pointer()
        signature = ir.FunctionType(ir.VoidType(), [byte, SHORT, SHORT, SHORT])
        prefetch = self._intrinsic(signature, "llvm.prefetch.p0")
        pointer = self.builder.inttoptr(self.address(address, ahead, 1), byte)
        self.builder.call(prefetch, [pointer, SHORT(0), SHORT(3), SHORT(1)])

    def loop(self, n: Value, start: Sequence[Row], body: Callable[[Value, list[Row]], Sequence[Row]]) -> list[Row]:
        """Rows after n passes of a loop; `body` gets the number of the pass and the rows, and returns the new rows."""
        builder, before = self.builder, self.builder.block
        head, inside, after = (builder.append_basic_block(name) for name in ("head", "body", "after"))
        builder.branch(head)
        builder.position_at_end(head)
        time = builder.phi(INTEGER)
        time.add_incoming(INTEGER(0), before)
        rows = [[builder.phi(value.type) for value in row] for row in start]
        for phi, value in zip(_flatten(rows), _flatten(start), strict=True):
            phi.add_incoming(value, before)
        builder.cbranch(builder.icmp_signed("<", time, n), inside, after)
        builder.position_at_end(inside)
        altered = body(time, rows)
        time.add_incoming(builder.add(time, INTEGER(1)), builder.block)
        for phi, value in zip(_flatten(rows), _flatten(altered), strict=True):
            phi.add_incoming(value, builder.block)
        builder.branch(head)
        builder.position_at_end(after)
        return rows

    def sums(self, n: Value, start: Sequence[Row], term: Callable[[Value], tuple[Sequence[Value], Row]]) -> list[Row]:
        """Rows after n additions of a row times one factor per row; `term` gives factors and row of each pass."""

        def body(time: Value, totals: list[Row]) -> list[Row]:
            factors, row = term(time)
            return [self.plus_times(total, factor, row) for total, factor in zip(totals, factors, strict=True)]

        return self.loop(n, start, body)

    def _intrinsic(self, signature: Any, name: str) -> Value:
        functions: Any = cgutils
        return functions.get_or_insert_function(self.builder.module, signature, name)

    def _load(self, address: Value, kind: Any, alignment: int) -> Value:
        value = self.builder.load(self.builder.inttoptr(address, kind.as_pointer()))
        value.align = alignment
        return value

    def _spread(self, number: Value, like: Value) -> Value:
        kind, nothing = like.type, ir.Constant(like.type, ir.Undefined)
        one = self.builder.insert_element(nothing, number, SHORT(0))
        return self.builder.shuffle_vector(one, nothing, ir.Constant(ir.VectorType(SHORT, kind.count), None))


def _flatten(rows: Iterable[Row]) -> list[Value]:
    return [value for row in rows for value in row]


def operation(write: Callable[..., None], heights: Sequence[int] = HEIGHTS) -> Any:
    """Make a function that compiled code calls with addresses and counts, the height of the tile, and lanes."""

    def define(_typing: Any, *kinds: Any) -> Any:
        lanes = kinds[-1]

        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            *numbers, height, _lanes = values
            for item in heights:
                with builder.if_then(builder.icmp_signed("==", height, INTEGER(item))):
                    write(Code(builder, lanes.count), item, *numbers)
            return context.get_dummy_value()

        return types.void(*[types.intp] * (len(kinds) - 1), lanes), generate

    # numba needs the names of the arguments.
    names = ["typing", *list(inspect.signature(write).parameters)[2:], "height", "lanes"]
    named: Any = define
    named.__signature__ = inspect.Signature([inspect.Parameter(name, POSITIONAL) for name in names])
    return intrinsic(named)


class Buffer:
    """Buffer that grows to the largest requested size."""

    def __init__(self) -> None:
        self._numbers = np.empty(0)

    def rows(self, n: int, length: int) -> Float[NDArray[np.float64], "n length"]:
        """Rows that begin on a cache line, so that loading a register touches one line; they are not cleared."""
        spare = LINE // self._numbers.itemsize
        if self._numbers.size < n * length + spare:
            self._numbers = np.empty(0)  # freed before the larger one is allocated
            self._numbers = np.empty(n * length + spare)
        first = -self._numbers.ctypes.data % LINE // self._numbers.itemsize
        return self._numbers[first : first + n * length].reshape(n, length)
