"""Load Intel's MKL from the wheel `mkl`, a dependency of `pypardiso`."""

import ctypes
import sys
from functools import cache
from pathlib import Path
from typing import Any

#: Interface layer LP64, in which all integer arguments have 32 bits; it is set independently of the environment.
SHORT_INTEGERS = 0


def count_threads() -> int:
    """Number of threads of MKL [-]."""
    return int(library().MKL_Get_Max_Threads())


@cache
def library() -> Any:
    """Load the library of MKL.

    Raises
    ------
    ImportError, OSError
        MKL is missing or cannot be loaded.
    """
    # The wheel `mkl` installs its libraries here. Importing pypardiso would search all files of the installation for
    # them, twice, which takes two seconds.
    for place in sorted(Path(sys.prefix).glob("lib/libmkl_rt.*")):
        result = ctypes.CDLL(str(place))
        break
    else:
        import pypardiso

        result = pypardiso.PyPardisoSolver().libmkl
    result.MKL_Set_Interface_Layer(SHORT_INTEGERS)
    return result
