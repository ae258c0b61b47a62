"""Memory for rows of numbers side by side, reused: fresh memory costs as much as a product."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.sparse.vector_code import LINE


class Buffer:
    """A buffer as large as has ever been asked for."""

    def __init__(self) -> None:
        self._numbers = np.empty(0)

    def rows(self, n: int, length: int) -> Float[NDArray[np.float64], "n length"]:
        """Rows that begin on a line of the cache, where a register's load would else touch two; not cleared."""
        spare = LINE // self._numbers.itemsize
        if self._numbers.size < n * length + spare:
            self._numbers = np.empty(0)  # not to stand beside the larger one
            self._numbers = np.empty(n * length + spare)
        first = -self._numbers.ctypes.data % LINE // self._numbers.itemsize
        return self._numbers[first : first + n * length].reshape(n, length)
