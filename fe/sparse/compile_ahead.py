"""Compile the kernels that solve with factors and multiply long columns, so that the first reduction does not wait."""

import numpy as np
import scipy.sparse as sp

from fe.sparse.factor import NODE
from fe.sparse.lower_columns import lower_columns, ordered_columns
from fe.sparse.narrow_product import project, subtract
from fe.sparse.product import SparseProduct
from fe.sparse.simd_code import LANES
from fe.sparse.supernodes import Supernodes, pack
from fe.sparse.upper_triangle import Upper


def compile_kernels() -> None:
    """Call each kernel with the smallest factor for each number of right-hand sides in `LANES`; code is stored."""
    one, start, only = np.ones(1), np.array([0, 1], dtype=np.int32), np.zeros(1, dtype=np.int32)
    upper = Upper(start, only, np.eye(3), 3)
    lower_columns(upper)
    ordered_columns(upper, np.arange(3, dtype=np.int32))
    layout, _n_value = pack(one, start, start, start, only)
    solver = Supernodes(one, layout, only)
    for n_column in LANES:
        columns = np.ones((1, n_column), order="F")
        solver.solve_into(columns, columns)
        subtract(columns, columns, project(columns, columns))
        for direction in (1, NODE):
            several = np.ones((direction, n_column), order="F")
            SparseProduct(sp.csr_array(np.eye(1)), direction).multiply_into(several, several)


if __name__ == "__main__":
    compile_kernels()
