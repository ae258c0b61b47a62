"""Results as netCDF4 files (which are HDF5 files), and the dimensions of their arrays."""

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from fe.file.hdf5_file import find_unsafe_hdf5_content
from hbsolve.errors import BalanceError

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")


def dimensions(result: Any) -> dict[str, tuple[str, ...]]:
    """Dimensions of the arrays of a data class by field, as named in its annotations, such as "side=2 level point"."""
    arrays = {item.name: item.type for item in fields(result) if hasattr(item.type, "dim_str")}
    return {name: tuple(item.split("=")[0] for item in kind.dim_str.split()) for name, kind in arrays.items()}


def write_netcdf(data: "xarray.Dataset", path: Path | str) -> None:
    """Write a data set: complex arrays as two real ones, truth values as 0 and 1, since netCDF has neither.

    A file that cannot be written is a `BalanceError`.
    """
    for name, array in data.data_vars.items():  # of the data set given: the loop replaces `data`
        if array.dtype.kind == "c":
            data = data.drop_vars([name]).assign({f"{name}_real": array.real, f"{name}_imag": array.imag})
        elif array.dtype.kind == "b":
            data = data.assign({name: array.astype(np.int8)})
    try:
        data.to_netcdf(path, engine="h5netcdf")
    except OSError as error:
        raise BalanceError(f'"{path}" cannot be written ({error.strerror or error}): choose another folder') from error


def read_netcdf(path: Path | str, what: str, read: Callable[["xarray.Dataset"], T]) -> T:
    """Read a result that `write_netcdf` wrote; `what` names the result and the method that wrote it in messages.

    Raises
    ------
    BalanceError
        The file is missing or contains something else.
    """
    import xarray

    if Path(path).is_file() and (defect := find_unsafe_hdf5_content(Path(path))):
        raise BalanceError(f'"{path}" is damaged, it {defect}: compute it again')
    try:
        with xarray.open_dataset(path, engine="h5netcdf") as data:
            return read(data)
    except Exception as error:  # a dozen types, depending on the damaged byte
        raise BalanceError(f'"{path}" contains no {what} wrote') from error
