"""Location of Intel's MKL: the wheel `mkl`, a dependency of `pypardiso`."""

import ctypes
import sys
from functools import cache
from pathlib import Path
from typing import Any

#: Interface layer LP64, whatever the environment says: all integers that are handed over have 32 bits.
SHORT_INTEGERS = 0


def count_threads() -> int:
    """Threads that MKL shares its work among [-]."""
    return int(library().MKL_Get_Max_Threads())


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
        result = ctypes.CDLL(str(place))
        break
    else:
        import pypardiso

        result = pypardiso.PyPardisoSolver().libmkl
    result.MKL_Set_Interface_Layer(SHORT_INTEGERS)
    return result
