"""Arrays as an ``.npz`` file that is the same to the byte whenever it is written."""

from collections.abc import Mapping
from pathlib import Path
from typing import IO
from zipfile import ZIP_STORED, ZipFile, ZipInfo

import numpy as np
from numpy.typing import ArrayLike

#: An array beyond this size may outgrow the 4 GB of a plain ZIP entry.
LARGE = 2**31


def write_npz(file: Path | IO[bytes], arrays: Mapping[str, ArrayLike], compression: int = ZIP_STORED) -> None:
    """As `numpy.savez` writes them, but with no time of writing, and never with pickled objects.

    Parameters
    ----------
    file
        Path with its suffix; or what is open for writing bytes.
    arrays
        Arrays by name.
    compression
        One of the constants of `zipfile`; ``ZIP_DEFLATED`` is `numpy.savez_compressed`.

    Raises
    ------
    ValueError
        An array of Python objects.
    """
    with ZipFile(file, "w", compression) as archive:
        for name, given in arrays.items():
            array, entry = np.asanyarray(given), ZipInfo(f"{name}.npy")
            entry.compress_type = compression
            with archive.open(entry, "w", force_zip64=array.nbytes > LARGE) as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)
