"""Products of a few rows of a factor with some right-hand sides, in the vector registers of the processor.

A library's matrix product copies its operands first, which costs as much as the work where there are a dozen columns
only. Here the rows of a factor are read once, as they lie in memory, and the results stay in registers meanwhile. What
a compiler makes of loops does not do that, so these few operations are written in the compiler's own language, the
intermediate representation of LLVM, through numba's intrinsics.

A tile is a few rows of the factor, column after column: of a tile of h rows, entry (r, k) stands at [h * k + r].
Right-hand sides are rows of a few numbers side by side, as many as the tuple `lanes` is long, so that each such number
has machine code of its own. All addresses are in bytes, as `array.ctypes.data` tells them.

References
----------
Goto and van de Geijn, Anatomy of high-performance matrix multiplication, ACM Trans. Math. Softw. 34 (2008) 12: why
results belong into registers.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from llvmlite import ir
from numba.core import cgutils, config, types
from numba.core.codegen import get_host_cpu_features
from numba.extending import intrinsic

DOUBLE, INTEGER, SHORT = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
SIZE, SHORT_SIZE = 8, 4
#: Bytes of a line of the cache.
LINE = 64
#: Numbers that one register holds at most.
REGISTER = 8
#: How far ahead of its use a tile is fetched [byte]: the processor by itself stops at the end of each page.
AHEAD = 4096
#: Columns of a basis are read side by side, so many tiles ahead.
NEXT = 4
#: Rows of a full tile on any processor.
TALLEST = 8
#: What the processor can do that machine code is made for: this one, or the one that numba was told.
SETTINGS: Any = config
HOST: Any = get_host_cpu_features
FEATURES = HOST() if SETTINGS.CPU_FEATURES is None else SETTINGS.CPU_FEATURES
#: Rows of a full tile there: with sixteen right-hand sides its results fill half of the 32 registers of AVX-512, with
#: twelve three quarters of the 16 smaller ones of AVX2.
ROWS = TALLEST if "+avx512f" in FEATURES else 4
#: Rows of all tiles there are, the full one first: what is left of a supernode is cut into the others.
HEIGHTS = tuple(height for height in (8, 4, 2, 1) if height <= ROWS)

#: Right-hand sides that are taken together: what is missing is filled up with zeros.
LANES = (4, 12, 16, 24)

POSITIONAL = inspect.Parameter.POSITIONAL_OR_KEYWORD
Value = Any
#: One row of right-hand sides, in one or several registers.
Row = list[Value]


def groups(n: int) -> Iterator[tuple[slice, tuple[int, ...]]]:
    """Parts of so many right-hand sides that are taken together, each with its tuple of lanes."""
    for first in range(0, n, LANES[-1]):
        some = slice(first, min(first + LANES[-1], n))
        yield some, (0,) * next(each for each in LANES if each >= some.stop - some.start)


class _Code:
    """Writes instructions for rows of so many right-hand sides."""

    def __init__(self, builder: Any, lanes: int) -> None:
        self.builder, self.lanes = builder, lanes
        full, rest = divmod(lanes, REGISTER)
        self.registers = [REGISTER] * full + [rest] * bool(rest)

    def address(self, base: Value, index: Value | int, stride: Value | int) -> Value:
        """Of an item that is `index` strides away."""
        if isinstance(index, int) and isinstance(stride, int):
            return self.builder.add(base, INTEGER(index * stride))
        index, stride = (INTEGER(each) if isinstance(each, int) else each for each in (index, stride))
        return self.builder.add(base, self.builder.mul(index, stride))

    def number(self, address: Value) -> Value:
        """The number at an address."""
        return self._load(address, DOUBLE, SIZE)

    def fetch_rows(self, x: Value, row: Value, first: int, last: int) -> None:
        """Bring those rows of x into the cache that come later in the list at `row`."""
        for index in range(first, last):
            place = self.place(x, row, index)
            for line in range(0, SIZE * self.lanes, LINE):
                self.fetch(place, line)

    def place(self, x: Value, row: Value, index: int) -> Value:
        """Address of the row of x that the list at `row` names."""
        number = self.builder.sext(self._load(self.address(row, index, SHORT_SIZE), SHORT, SHORT_SIZE), INTEGER)
        return self.address(x, number, SIZE * self.lanes)

    def row(self, address: Value) -> Row:
        """The row at an address."""
        return [
            self._load(self.address(address, k * REGISTER, SIZE), ir.VectorType(DOUBLE, width), SIZE)
            for k, width in enumerate(self.registers)
        ]

    def store(self, row: Row, address: Value) -> None:
        """Put a row at an address."""
        for k, value in enumerate(row):
            pointer = self.builder.inttoptr(self.address(address, k * REGISTER, SIZE), value.type.as_pointer())
            self.builder.store(value, pointer).align = SIZE

    def zero(self) -> Row:
        """A row of zeros."""
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
        """The row's negative."""
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
        """Bring what will be read soon into the cache."""
        byte = ir.IntType(8).as_pointer()
        signature = ir.FunctionType(ir.VoidType(), [byte, SHORT, SHORT, SHORT])
        prefetch = self._intrinsic(signature, "llvm.prefetch.p0")
        pointer = self.builder.inttoptr(self.address(address, ahead, 1), byte)
        self.builder.call(prefetch, [pointer, SHORT(0), SHORT(3), SHORT(1)])

    def loop(self, n: Value, start: Sequence[Row], body: Callable[[Value, list[Row]], Sequence[Row]]) -> list[Row]:
        """Rows that a body alters n times; it is told which time it is."""
        builder, before = self.builder, self.builder.block
        head, inside, after = (builder.append_basic_block(name) for name in ("head", "body", "after"))
        builder.branch(head)
        builder.position_at_end(head)
        time = builder.phi(INTEGER)
        time.add_incoming(INTEGER(0), before)
        rows = [[builder.phi(value.type) for value in row] for row in start]
        for phi, value in zip(_flat(rows), _flat(start), strict=True):
            phi.add_incoming(value, before)
        builder.cbranch(builder.icmp_signed("<", time, n), inside, after)
        builder.position_at_end(inside)
        altered = body(time, rows)
        time.add_incoming(builder.add(time, INTEGER(1)), builder.block)
        for phi, value in zip(_flat(rows), _flat(altered), strict=True):
            phi.add_incoming(value, builder.block)
        builder.branch(head)
        builder.position_at_end(after)
        return rows

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


def _flat(rows: Iterable[Row]) -> list[Value]:
    return [value for row in rows for value in row]


def _operation(write: Callable[..., None]) -> Any:
    """What compiled code calls with addresses and counts, the height of the tile, and a tuple as long as its lanes."""

    def define(_typing: Any, *kinds: Any) -> Any:
        lanes = kinds[-1]

        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            *numbers, height, _lanes = values
            for each in HEIGHTS:
                with builder.if_then(builder.icmp_signed("==", height, INTEGER(each))):
                    write(_Code(builder, lanes.count), each, *numbers)
            return context.get_dummy_value()

        return types.void(*[types.intp] * (len(kinds) - 1), lanes), generate

    # numba asks for the names of what is handed over.
    names = ["typing", *list(inspect.signature(write).parameters)[2:], "height", "lanes"]
    named: Any = define
    named.__signature__ = inspect.Signature([inspect.Parameter(name, POSITIONAL) for name in names])
    return intrinsic(named)


def _product(code: _Code, height: int, tile: Value, own: Value, n_column: Value) -> list[Row]:
    """Tile times the first rows of `own`."""

    def body(k: Value, sums: list[Row]) -> list[Row]:
        column = code.address(tile, k, SIZE * height)
        code.fetch(column)
        y = code.row(code.address(own, k, SIZE * code.lanes))
        return [code.plus_times(total, code.number(code.address(column, r, SIZE)), y) for r, total in enumerate(sums)]

    return code.loop(n_column, [code.zero() for _ in range(height)], body)


def _subtract_transposed(code: _Code, tile: Value, own: Value, n_column: Value, x: list[Row]) -> None:
    """Take tile^T x from the first rows of `own`."""
    height, x = len(x), [code.negative(row) for row in x]

    def body(k: Value, _: list[Row]) -> list[Row]:
        column, place = code.address(tile, k, SIZE * height), code.address(own, k, SIZE * code.lanes)
        code.fetch(column)
        entries = [code.number(code.address(column, r, SIZE)) for r in range(height)]
        # Two sums, as each addition waits for the one before.
        even, odd = code.row(place), code.zero()
        for r in range(0, height, 2):
            even = code.plus_times(even, entries[r], x[r])
        for r in range(1, height, 2):
            odd = code.plus_times(odd, entries[r], x[r])
        code.store(code.plus(even, odd), place)
        return []

    code.loop(n_column, [], body)


def _subtract_product(code: _Code, height: int, tile: Value, own: Value, n_column: Value, x: Value, row: Value) -> None:
    code.fetch_rows(x, row, height, 2 * height)
    for r, product in enumerate(_product(code, height, tile, own, n_column)):
        place = code.place(x, row, r)
        code.store(code.minus(code.row(place), product), place)


def _subtract_transposed_product(
    code: _Code, height: int, tile: Value, own: Value, n_column: Value, x: Value, row: Value
) -> None:
    code.fetch_rows(x, row, height, 2 * height)
    below = [code.row(code.place(x, row, r)) for r in range(height)]
    _subtract_transposed(code, tile, own, n_column, below)


def _solve_lower(code: _Code, height: int, tile: Value, own: Value, first: Value) -> None:
    begin, triangle = code.address(own, first, SIZE * code.lanes), code.address(tile, first, SIZE * height)
    place = [code.address(begin, r, SIZE * code.lanes) for r in range(height)]
    products = _product(code, height, tile, own, first)
    x = [code.minus(code.row(place[r]), products[r]) for r in range(height)]
    for k in range(height):
        column = code.address(triangle, k, SIZE * height)
        x[k] = code.times(code.number(code.address(column, k, SIZE)), x[k])
        found = code.negative(x[k])
        for r in range(k + 1, height):
            x[r] = code.plus_times(x[r], code.number(code.address(column, r, SIZE)), found)
    for r in range(height):
        code.store(x[r], place[r])


def _solve_upper(code: _Code, height: int, tile: Value, own: Value, first: Value) -> None:
    begin, triangle = code.address(own, first, SIZE * code.lanes), code.address(tile, first, SIZE * height)
    place = [code.address(begin, r, SIZE * code.lanes) for r in range(height)]
    x = [code.row(each) for each in place]
    found: list[Row] = []
    for k in reversed(range(height)):
        column = code.address(triangle, k, SIZE * height)
        for r, negative in zip(reversed(range(k + 1, height)), found, strict=True):
            x[k] = code.plus_times(x[k], code.number(code.address(column, r, SIZE)), negative)
        x[k] = code.times(code.number(code.address(column, k, SIZE)), x[k])
        found.append(code.negative(x[k]))
    for r in range(height):
        code.store(x[r], place[r])
    _subtract_transposed(code, tile, own, first, x)


def _add_projection(code: _Code, height: int, columns: Value, stride: Value, z: Value, n: Value, sums: Value) -> None:
    begin = [code.address(columns, r, stride) for r in range(height)]
    place = [code.address(sums, r, SIZE * code.lanes) for r in range(height)]

    def body(i: Value, totals: list[Row]) -> list[Row]:
        row = code.row(code.address(z, i, SIZE * code.lanes))
        entries = [code.number(code.address(each, i, SIZE)) for each in begin]
        return [code.plus_times(total, entry, row) for total, entry in zip(totals, entries, strict=True)]

    for address, total in zip(place, code.loop(n, [code.row(each) for each in place], body), strict=True):
        code.store(total, address)


def _add_combination(
    code: _Code, height: int, columns: Value, stride: Value, factors: Value, n: Value, sums: Value
) -> None:
    place = [code.address(sums, r, SIZE * code.lanes) for r in range(height)]

    def body(k: Value, totals: list[Row]) -> list[Row]:
        column = code.address(columns, k, stride)
        code.fetch(column, NEXT * SIZE * height)
        row = code.row(code.address(factors, k, SIZE * code.lanes))
        entries = [code.number(code.address(column, r, SIZE)) for r in range(height)]
        return [code.plus_times(total, entry, row) for total, entry in zip(totals, entries, strict=True)]

    for address, total in zip(place, code.loop(n, [code.row(each) for each in place], body), strict=True):
        code.store(total, address)


#: (tile, own, n_column, x, row, height, lanes): take the product of a tile with `n_column` rows of right-hand sides
#: from those rows of x that the list at `row` names.
subtract_product = _operation(_subtract_product)
#: (tile, own, n_column, x, row, height, lanes): take the transposed tile times those rows of x that the list at `row`
#: names from `n_column` rows of right-hand sides.
subtract_transposed_product = _operation(_subtract_transposed_product)
#: (tile, own, first, height, lanes): solve for the rows from `first` on, by a tile that ends with its triangle, of
#: which the diagonal is inverted.
solve_lower = _operation(_solve_lower)
#: (tile, own, first, height, lanes): the same with the transposed triangle; then take what is found from the rows
#: before.
solve_upper = _operation(_solve_upper)
#: (columns, stride, z, n, sums, height, lanes): add the products of columns, `stride` bytes apart, with n rows of z to
#: as many rows of sums.
add_projection = _operation(_add_projection)
#: (columns, stride, factors, n, sums, height, lanes): add n columns, `stride` bytes apart, times as many rows of
#: factors to rows of sums.
add_combination = _operation(_add_combination)
