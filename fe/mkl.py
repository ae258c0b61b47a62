"""Where Intel's MKL is: the wheel `mkl`, which `pypardiso` brings along."""

import ctypes
import sys
from functools import cache
from pathlib import Path
from typing import Any


@cache
def library() -> Any:
    """MKL's library.

    Raises
    ------
    ImportError, OSError
        There is no MKL, or it cannot be loaded.
    """
    # The wheel `mkl` puts its libraries here. Importing pypardiso would search all files of the installation for them,
    # twice, which takes two seconds.
    for place in sorted(Path(sys.prefix).glob("lib/libmkl_rt.*")):
        return ctypes.CDLL(str(place))
    import pypardiso

    return pypardiso.PyPardisoSolver().libmkl
