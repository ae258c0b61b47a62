"""Types of arrays that are used in many files; docstrings give shapes and units."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Real = NDArray[np.float64]
Whole = NDArray[np.int64]
Array = NDArray[np.complex128]
Vector = Float[Real, " n"]
Matrix = Float[Real, "n m"]
#: Weights of the degrees of freedom of a structure.
Row = Float[Real, " r"]
#: Rows, one per direction.
Rows = Float[Real, "d r"]
