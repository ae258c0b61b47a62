"""Results as MATLAB files, which Octave and SciPy read as well."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fe.notebook import Labelled
from hbsolve.errors import BalanceError
from hbsolve.netcdf import write_netcdf
from reduction.file.atomic_file import write_atomically

if TYPE_CHECKING:
    import xarray

REAL, IMAGINARY = "_real", "_imag"

#: Text at the beginning of a MATLAB 5 file, and its length [byte].
TITLE, _TITLE_LENGTH = b"MATLAB 5.0 MAT-file, written by stickslip", 116


def make_matlab_file(data: "xarray.Dataset") -> bytes:
    """A data set as the bytes of a MATLAB 5 file.

    Each array is a variable of its name, with the dimensions in the order of the data set. Names along a dimension are
    a cell array, such as ``joint_name``. A pair of real and imaginary parts becomes one complex array. The struct
    ``units`` holds the unit of each variable that has a unit, ``dimensions`` the names of its axes, ``attributes`` the
    attributes of the data set.
    """
    from scipy.io import savemat

    content, units, axes = dict[str, Any](), dict[str, str](), dict[str, str]()
    for name, array in data.variables.items():
        values, key = np.asarray(array.values), str(name)
        if key.endswith(IMAGINARY) and key.removesuffix(IMAGINARY) + REAL in data.variables:
            continue
        partner = key.removesuffix(REAL) + IMAGINARY
        if key.endswith(REAL) and partner in data.variables:
            values, key = values + 1j * data[partner].values, key.removesuffix(REAL)
        if values.dtype.kind in "OUT":
            values, key = np.array(values, dtype=object), f"{key}_name" if name in data.dims else key
        content[key] = values
        axes[key] = " ".join(map(str, array.dims))
        if "units" in array.attrs:
            units[key] = str(array.attrs["units"])
    attributes = {str(key): str(value) for key, value in data.attrs.items()}
    structs = {"units": units, "dimensions": axes, "attributes": attributes}
    content |= {name: struct for name, struct in structs.items() if struct}
    stream: Any = BytesIO()  # SciPy's annotation has only file names
    savemat(stream, content, appendmat=False, long_field_names=True, oned_as="column", do_compression=True)
    # SciPy writes the time here; it is replaced, so that equal results give equal files.
    return TITLE.ljust(_TITLE_LENGTH) + bytes(stream.getvalue())[_TITLE_LENGTH:]


class Exported(Labelled):
    """A result of arrays that can be saved as a netCDF or a MATLAB file."""

    def save(self, path: Path | str) -> None:
        """Write netCDF4 (an HDF5 file), complex arrays as two real variables.

        Raises
        ------
        BalanceError
            The file cannot be written.
        """
        write_netcdf(self.to_xarray(), path)

    def save_matlab(self, path: Path | str) -> None:
        """Write a MATLAB file, see `make_matlab_file`; an existing file is replaced in one step.

        Raises
        ------
        BalanceError
            The file cannot be written.
        """
        content = make_matlab_file(self.to_xarray())
        write_atomically(path, lambda file: file.write_bytes(content), BalanceError)
