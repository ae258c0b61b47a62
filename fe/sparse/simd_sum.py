"""Sums over long columns or over the entries of a sparse row, for a few columns at once; see `fe.sparse.simd_code`."""

from collections.abc import Callable

from fe.sparse.simd_code import SHORT_SIZE, SIZE, Code, Row, Value, operation

#: Number of tiles by which columns of a basis are prefetched.
NEXT = 4


def _add_projection(code: Code, height: int, columns: Value, stride: Value, z: Value, n: Value, sums: Value) -> None:
    begin = [code.address(columns, r, stride) for r in range(height)]

    def term(i: Value) -> tuple[list[Value], Row]:
        row = code.row(code.address(z, i, SIZE * code.lanes))
        return [code.number(code.address(item, i, SIZE)) for item in begin], row

    _add(code, height, n, sums, term)


def _add_combination(
    code: Code, height: int, columns: Value, stride: Value, factors: Value, n: Value, sums: Value
) -> None:
    def term(k: Value) -> tuple[list[Value], Row]:
        column = code.address(columns, k, stride)
        code.fetch(column, NEXT * SIZE * height)
        row = code.row(code.address(factors, k, SIZE * code.lanes))
        return code.numbers(column, height), row

    _add(code, height, n, sums, term)


def _add(code: Code, height: int, n: Value, sums: Value, term: Callable[[Value], tuple[list[Value], Row]]) -> None:
    """Add n terms to rows of sums."""
    place = [code.address(sums, r, SIZE * code.lanes) for r in range(height)]
    for address, total in zip(place, code.sums(n, [code.row(item) for item in place], term), strict=True):
        code.store(total, address)


def _put_sparse_row(code: Code, _height: int, values: Value, column: Value, n: Value, x: Value, result: Value) -> None:
    def term(e: Value) -> tuple[list[Value], Row]:
        place = code.place(x, code.address(column, e, SHORT_SIZE), 0)
        return code.numbers(code.address(values, e, SIZE), 1), code.row(place)

    code.store(code.sums(n, [code.zero()], term)[0], result)


#: (columns, stride, z, n, sums, height, lanes): add the products of `height` columns, `stride` bytes apart, with n rows
#: of z to as many rows of sums.
add_projection = operation(_add_projection)
#: (columns, stride, factors, n, sums, height, lanes): add n columns, `stride` bytes apart, times n rows of factors to
#: `height` rows of sums.
add_combination = operation(_add_combination)
#: (values, column, n, x, result, 1, lanes): store the sum of n values times the rows of x with the numbers at `column`.
put_sparse_row = operation(_put_sparse_row, (1,))
