"""Solutions with a matrix that changes by one outer product after another, by a single factorisation."""

from reduction.array_type import Matrix, Vector


class UpdatedFactor:
    """A matrix that is factored once, and solved with after updates by u v^T (Sherman and Morrison's formula)."""

    def __init__(self, matrix: Matrix) -> None:
        from scipy.linalg import lu_factor

        self._factor = lu_factor(matrix, check_finite=False)
        self._updates: list[tuple[Vector, Vector]] = []

    def update(self, column: Vector, row: Vector) -> None:
        """Add column row^T."""
        moved = self.solve(column)
        self._updates.append((moved / (1 + row @ moved), row))

    def solve(self, right: Vector) -> Vector:
        """The solution for one right side."""
        from scipy.linalg import lu_solve

        solution: Vector = lu_solve(self._factor, right, check_finite=False)
        for moved, row in self._updates:
            solution -= moved * (row @ solution)
        return solution
