"""Factorise with SuperLU of SciPy, which is always available."""

import numpy as np
import scipy.sparse as sp

from fe.sparse.factor import Columns, Symmetric, UnknownInertia, check_pattern, columns_and_place, singular
from fe.sparse.symmetry import check_symmetric


class SuperLU:
    """Symmetric-mode SuperLU: the ordering keeps the symmetry, pivots stay on the diagonal unless they are tiny.

    SciPy has no separate symbolic analysis, so `renew` is not faster than a new factorisation.
    """

    def __init__(self, matrix: sp.csr_array) -> None:
        self._shape, self._nnz = matrix.shape, matrix.nnz
        self._factorise(matrix)

    def renew(self, matrix: Symmetric) -> None:
        """As `Factorisation.renew`."""
        check_symmetric(matrix)
        matrix = matrix.tocsr()
        check_pattern(matrix, self._shape, self._nnz)
        self._factorise(matrix)

    def _factorise(self, matrix: sp.csr_array) -> None:
        try:
            self._lu = sp.linalg.splu(
                sp.csc_array(matrix, dtype=np.float64),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.001,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise singular(matrix.shape[0], f": {error}") from error

    def solve(self, right_hand_side: Columns, out: Columns | None = None) -> Columns:
        """As `Factor.solve`."""
        b, place = columns_and_place(self._shape, right_hand_side, out)
        place[...] = self._lu.solve(b)
        return place

    @property
    def n_negative(self) -> int:
        """As `Factorisation.n_negative`."""
        if (self._lu.perm_r != self._lu.perm_c).any():
            raise UnknownInertia(
                "SuperLU took off-diagonal pivots, whose signs do not count eigenvalues: move the shift slightly"
            )
        return int(np.count_nonzero(self._lu.U.diagonal() < 0))
