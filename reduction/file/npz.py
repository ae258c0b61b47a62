"""Write arrays as an ``.npz`` file whose bytes depend only on the arrays."""

from collections.abc import Mapping
from pathlib import Path
from typing import IO
from zipfile import ZIP_STORED, ZipFile, ZipInfo

import numpy as np
from numpy.typing import ArrayLike

#: Size above which an array may exceed the 4 GB of a plain ZIP entry [byte].
LARGE = 2**31


def write_npz(file: Path | IO[bytes], arrays: Mapping[str, ArrayLike], compression: int = ZIP_STORED) -> None:
    """Write arrays as `numpy.savez` does, but without the time of writing and without pickled objects.

    Parameters
    ----------
    file
        Path with its suffix, or a stream that is open for writing bytes.
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
