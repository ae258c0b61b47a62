"""Products of a few rows of a factor with some right-hand sides, in the vector registers of the processor.

A library's matrix product copies its operands first, which costs as much as the work where there are a dozen columns
only. Here the rows of a factor are read once, as they lie in memory, and the results stay in registers meanwhile. What
a compiler makes of loops does not do that, so these few operations are written in the compiler's own language, the
intermediate representation of LLVM, through numba's intrinsics.

A tile is `rows` rows of the factor, column after column: entry (r, k) stands at [rows * k + r]. Right-hand sides are
rows of `lanes` numbers side by side. All addresses are in bytes, as `array.ctypes.data` tells them.

References
----------
Goto and van de Geijn, Anatomy of high-performance matrix multiplication, ACM Trans. Math. Softw. 34 (2008) 12: why
results belong into registers.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from llvmlite import binding, ir
from numba.core import cgutils, types
from numba.extending import intrinsic

DOUBLE, INTEGER, SHORT = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
SIZE, SHORT_SIZE = 8, 4
#: Numbers that one register holds at most.
REGISTER = 8
#: How far ahead of its use a tile is fetched [byte]: the processor by itself stops at the end of each page.
AHEAD = 4096
#: Rows of a full tile: with sixteen right-hand sides its results fill half of the 32 registers of AVX-512, or of the
#: smaller ones of other processors.
ROWS = 8 if binding.get_host_cpu_features().get("avx512f") else 4

Value = Any
#: One row of right-hand sides, in one or several registers.
Row = list[Value]


class _Code:
    """Instructions for rows of so many right-hand sides."""

    def __init__(self, builder: Any, lanes: int) -> None:
        self.builder, self.lanes = builder, lanes
        full, rest = divmod(lanes, REGISTER)
        self.registers = [REGISTER] * full + [rest] * bool(rest)

    def address(self, base: Value, index: Value | int, stride: int) -> Value:
        """Of an item that is `index` strides away."""
        if isinstance(index, int):
            return self.builder.add(base, INTEGER(index * stride))
        return self.builder.add(base, self.builder.mul(index, INTEGER(stride)))

    def number(self, address: Value) -> Value:
        return self._load(address, DOUBLE, SIZE)

    def place(self, x: Value, row: Value, index: int) -> Value:
        """Address of the row of x that the list at `row` names."""
        number = self.builder.sext(self._load(self.address(row, index, SHORT_SIZE), SHORT, SHORT_SIZE), INTEGER)
        return self.address(x, number, SIZE * self.lanes)

    def row(self, address: Value) -> Row:
        return [
            self._load(self.address(address, k * REGISTER, SIZE), ir.VectorType(DOUBLE, width), SIZE)
            for k, width in enumerate(self.registers)
        ]

    def store(self, row: Row, address: Value) -> None:
        for k, value in enumerate(row):
            pointer = self.builder.inttoptr(self.address(address, k * REGISTER, SIZE), value.type.as_pointer())
            self.builder.store(value, pointer).align = SIZE

    def zero(self) -> Row:
        return [ir.Constant(ir.VectorType(DOUBLE, width), None) for width in self.registers]

    def times(self, factor: Value, row: Row) -> Row:
        return [self.builder.fmul(self._spread(factor, value), value) for value in row]

    def plus(self, a: Row, b: Row) -> Row:
        return [self.builder.fadd(x, y) for x, y in zip(a, b, strict=True)]

    def minus(self, a: Row, b: Row) -> Row:
        return [self.builder.fsub(x, y) for x, y in zip(a, b, strict=True)]

    def negative(self, row: Row) -> Row:
        return [self.builder.fneg(value) for value in row]

    def plus_times(self, a: Row, factor: Value, row: Row) -> Row:
        """a + factor * row, rounded once."""
        result = []
        for x, y in zip(a, row, strict=True):
            kind = x.type
            signature = ir.FunctionType(kind, [kind] * 3)
            multiply_add = cgutils.get_or_insert_function(
                self.builder.module, signature, f"llvm.fma.v{kind.count}f64"
            )
            result.append(self.builder.call(multiply_add, [self._spread(factor, y), y, x]))
        return result

    def fetch(self, address: Value) -> None:
        """Bring a part of a tile into the cache that will be read soon."""
        byte = ir.IntType(8).as_pointer()
        signature = ir.FunctionType(ir.VoidType(), [byte, SHORT, SHORT, SHORT])
        prefetch = cgutils.get_or_insert_function(self.builder.module, signature, "llvm.prefetch.p0")
        ahead = self.builder.inttoptr(self.address(address, AHEAD, 1), byte)
        self.builder.call(prefetch, [ahead, SHORT(0), SHORT(3), SHORT(1)])

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


def _product(code: _Code, tile: Value, own: Value, n_column: Value, rows: int) -> list[Row]:
    """Tile times the first rows of `own`."""

    def body(k: Value, sums: list[Row]) -> list[Row]:
        column = code.address(tile, k, SIZE * rows)
        code.fetch(column)
        y = code.row(code.address(own, k, SIZE * code.lanes))
        return [code.plus_times(total, code.number(code.address(column, r, SIZE)), y) for r, total in enumerate(sums)]

    return code.loop(n_column, [code.zero() for _ in range(rows)], body)


def _subtract_transposed(code: _Code, tile: Value, own: Value, n_column: Value, x: list[Row]) -> None:
    """Take tile^T x from the first rows of `own`."""
    x = [code.negative(row) for row in x]

    def body(k: Value, _: list[Row]) -> list[Row]:
        column, place = code.address(tile, k, SIZE * len(x)), code.address(own, k, SIZE * code.lanes)
        code.fetch(column)
        # Two sums, as each addition waits for the one before.
        entries = [code.number(code.address(column, r, SIZE)) for r in range(len(x))]
        sums = [code.row(place), code.times(entries[1], x[1]) if len(x) > 1 else None]
        for r in range(len(x)):
            if r != 1:
                sums[r % 2] = code.plus_times(sums[r % 2], entries[r], x[r])
        code.store(sums[0] if sums[1] is None else code.plus(sums[0], sums[1]), place)
        return []

    code.loop(n_column, [], body)


@intrinsic(prefer_literal=True)
def subtract_product(typing: Any, tile, own, n_column, x, row, rows, lanes) -> Any:  # type: ignore[no-untyped-def]
    """Take the product of a tile with `n_column` rows of right-hand sides from those rows of x that a list names."""

    def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        code = _Code(builder, lanes.count)
        tile, own, n_column, x, row = values[:5]
        for r, product in enumerate(_product(code, tile, own, n_column, rows.literal_value)):
            place = code.place(x, row, r)
            code.store(code.minus(code.row(place), product), place)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5, rows, lanes), generate


@intrinsic(prefer_literal=True)
def subtract_transposed(typing: Any, tile, own, n_column, x, row, rows, lanes) -> Any:  # type: ignore[no-untyped-def]
    """Take the transposed tile times those rows of x that a list names from `n_column` rows of right-hand sides."""

    def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        code = _Code(builder, lanes.count)
        tile, own, n_column, x, row = values[:5]
        below = [code.row(code.place(x, row, r)) for r in range(rows.literal_value)]
        _subtract_transposed(code, tile, own, n_column, below)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 5, rows, lanes), generate


@intrinsic(prefer_literal=True)
def solve_lower(typing: Any, tile, own, first, rows, lanes) -> Any:  # type: ignore[no-untyped-def]
    """Solve for the `rows` unknowns from `first` on, by a tile that ends with its triangle, diagonal inverted."""

    def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        code, n = _Code(builder, lanes.count), rows.literal_value
        tile, own, first = values[:3]
        place = [code.address(code.address(own, first, SIZE * code.lanes), r, SIZE * code.lanes) for r in range(n)]
        triangle = code.address(tile, first, SIZE * n)
        products = _product(code, tile, own, first, n)
        x = [code.minus(code.row(place[r]), products[r]) for r in range(n)]
        for k in range(n):
            x[k] = code.times(code.number(code.address(triangle, n * k + k, SIZE)), x[k])
            for r in range(k + 1, n):
                entry = builder.fneg(code.number(code.address(triangle, n * k + r, SIZE)))
                x[r] = code.plus_times(x[r], entry, x[k])
        for r in range(n):
            code.store(x[r], place[r])
        return context.get_dummy_value()

    return types.void(*[types.intp] * 3, rows, lanes), generate


@intrinsic(prefer_literal=True)
def solve_upper(typing: Any, tile, own, first, rows, lanes) -> Any:  # type: ignore[no-untyped-def]
    """As `solve_lower` with the transposed triangle; then take what is found from the unknowns before `first`."""

    def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        code, n = _Code(builder, lanes.count), rows.literal_value
        tile, own, first = values[:3]
        place = [code.address(code.address(own, first, SIZE * code.lanes), r, SIZE * code.lanes) for r in range(n)]
        triangle = code.address(tile, first, SIZE * n)
        x = [code.row(place[r]) for r in range(n)]
        for k in reversed(range(n)):
            for r in range(k + 1, n):
                entry = builder.fneg(code.number(code.address(triangle, n * k + r, SIZE)))
                x[k] = code.plus_times(x[k], entry, x[r])
            x[k] = code.times(code.number(code.address(triangle, n * k + k, SIZE)), x[k])
        for r in range(n):
            code.store(x[r], place[r])
        _subtract_transposed(code, tile, own, first, x)
        return context.get_dummy_value()

    return types.void(*[types.intp] * 3, rows, lanes), generate
