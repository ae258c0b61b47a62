"""Results as netCDF4 files (which are HDF5 files)."""

from pathlib import Path
from typing import TYPE_CHECKING

from hbsolve.errors import BalanceError

if TYPE_CHECKING:
    import xarray


def write_netcdf(data: "xarray.Dataset", path: Path | str) -> None:
    """Write a data set.

    Raises
    ------
    BalanceError
        The file cannot be written.
    """
    try:
        data.to_netcdf(path, engine="h5netcdf")
    except OSError as error:
        raise BalanceError(f'"{path}" cannot be written ({error.strerror or error}): choose another folder') from error
