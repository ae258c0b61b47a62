"""Products and solutions with a few rows of a factor, which are read once in the order of memory.

A tile is a few rows of the factor, column after column: entry (r, k) of a tile of h rows is at [h * k + r]. Right-hand
sides and addresses are described in `fe.sparse.simd_code`.
"""

from fe.sparse.simd_code import SIZE, Code, Row, Value, operation


def _multiply(code: Code, height: int, tile: Value, own: Value, n_column: Value) -> list[Row]:
    """Product of the tile with the first rows of `own`."""

    def term(k: Value) -> tuple[list[Value], Row]:
        column = code.address(tile, k, SIZE * height)
        code.fetch(column)
        return code.numbers(column, height), code.row(code.address(own, k, SIZE * code.lanes))

    return code.sums(n_column, [code.zero() for _ in range(height)], term)


def _subtract_transposed(code: Code, tile: Value, own: Value, n_column: Value, x: list[Row]) -> None:
    """Subtract tile^T x from the first rows of `own`."""
    height, x = len(x), [code.negative(row) for row in x]

    def body(k: Value, _: list[Row]) -> list[Row]:
        column, place = code.address(tile, k, SIZE * height), code.address(own, k, SIZE * code.lanes)
        code.fetch(column)
        entries = code.numbers(column, height)
        # Two sums, because each addition waits for the previous one.
        even, odd = code.row(place), code.zero()
        for r in range(0, height, 2):
            even = code.plus_times(even, entries[r], x[r])
        for r in range(1, height, 2):
            odd = code.plus_times(odd, entries[r], x[r])
        code.store(code.plus(even, odd), place)
        return []

    code.loop(n_column, [], body)


def _subtract_product(code: Code, height: int, tile: Value, own: Value, n_column: Value, x: Value, row: Value) -> None:
    code.fetch_rows(x, row, height, 2 * height)
    for r, product in enumerate(_multiply(code, height, tile, own, n_column)):
        place = code.place(x, row, r)
        code.store(code.minus(code.row(place), product), place)


def _subtract_transposed_product(
    code: Code, height: int, tile: Value, own: Value, n_column: Value, x: Value, row: Value
) -> None:
    code.fetch_rows(x, row, height, 2 * height)
    below = [code.row(code.place(x, row, r)) for r in range(height)]
    _subtract_transposed(code, tile, own, n_column, below)


def _solve_lower(code: Code, height: int, tile: Value, own: Value, first: Value) -> None:
    begin, triangle = code.address(own, first, SIZE * code.lanes), code.address(tile, first, SIZE * height)
    place = [code.address(begin, r, SIZE * code.lanes) for r in range(height)]
    products = _multiply(code, height, tile, own, first)
    x = [code.minus(code.row(place[r]), products[r]) for r in range(height)]
    for k in range(height):
        column = code.address(triangle, k, SIZE * height)
        x[k] = code.times(code.number(code.address(column, k, SIZE)), x[k])
        negated = code.negative(x[k])
        for r in range(k + 1, height):
            x[r] = code.plus_times(x[r], code.number(code.address(column, r, SIZE)), negated)
    for r in range(height):
        code.store(x[r], place[r])


def _solve_upper(code: Code, height: int, tile: Value, own: Value, first: Value) -> None:
    begin, triangle = code.address(own, first, SIZE * code.lanes), code.address(tile, first, SIZE * height)
    place = [code.address(begin, r, SIZE * code.lanes) for r in range(height)]
    x = [code.row(item) for item in place]
    negated: list[Row] = []
    for k in reversed(range(height)):
        column = code.address(triangle, k, SIZE * height)
        for r, negative in zip(reversed(range(k + 1, height)), negated, strict=True):
            x[k] = code.plus_times(x[k], code.number(code.address(column, r, SIZE)), negative)
        x[k] = code.times(code.number(code.address(column, k, SIZE)), x[k])
        negated.append(code.negative(x[k]))
    for r in range(height):
        code.store(x[r], place[r])
    _subtract_transposed(code, tile, own, first, x)


#: (tile, own, n_column, x, row, height, lanes): subtract the product of a tile with the `n_column` rows at `own` from
#: the rows of x whose numbers are at `row`.
subtract_product = operation(_subtract_product)
#: (tile, own, n_column, x, row, height, lanes): subtract the product of the transposed tile with the rows of x whose
#: numbers are at `row` from the `n_column` rows at `own`.
subtract_transposed_product = operation(_subtract_transposed_product)
#: (tile, own, first, height, lanes): solve for the rows from `first` with a tile that ends with a triangle; the
#: diagonal of the triangle is inverted.
solve_lower = operation(_solve_lower)
#: (tile, own, first, height, lanes): solve with the transposed triangle; then subtract the product of the transposed
#: tile with the solution from the rows before `first`.
solve_upper = operation(_solve_upper)
