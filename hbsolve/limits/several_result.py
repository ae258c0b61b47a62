"""Limits of several quantities of one search as one data set, and as one file."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hbsolve.errors import BalanceError
from hbsolve.limits.result import ResponseLimits, read_limits_from_xarray
from hbsolve.netcdf import read_netcdf, write_netcdf

if TYPE_CHECKING:
    import xarray

#: Fields of the search, common to all of its quantities.
SHARED = ("angular_frequency", "level", "nominal", "reach")


def join_limits(limits: Mapping[str, ResponseLimits], units: Mapping[str, str]) -> "xarray.Dataset":
    """One labelled data set of the limits of one search, with the names along the dimension "quantity".

    Parameters
    ----------
    limits
        Limits by name, at least one.
    units
        SI unit of each quantity by name, which becomes the coordinate "unit".

    Raises
    ------
    BalanceError
        No limits, or limits of different frequencies, levels or boxes.
    """
    import xarray

    if not limits:
        raise BalanceError("there are no limits: give those of at least one quantity")
    first = next(iter(limits.values()))
    for name, item in limits.items():
        for shared in SHARED:
            if not np.array_equal(getattr(item, shared), getattr(first, shared)):
                raise BalanceError(
                    f'limits of "{name}" have a different {shared} from those before: join those of one search'
                )
    parts = [item.to_xarray() for item in limits.values()]
    own = xarray.concat([part.drop_vars([*SHARED, "frequency"]) for part in parts], "quantity")
    joined = own.assign({name: parts[0][name] for name in SHARED})
    names = list(limits)
    return joined.assign_coords(
        quantity=names, unit=("quantity", [units[name] for name in names]), frequency=parts[0]["frequency"]
    )


def save_several_limits(limits: Mapping[str, ResponseLimits], units: Mapping[str, str], path: Path | str) -> None:
    """Write one netCDF4 file (an HDF5 file) of `join_limits`.

    Raises
    ------
    BalanceError
        As `join_limits`, or the file cannot be written.
    """
    write_netcdf(join_limits(limits, units).drop_vars("frequency"), path)


def load_several_limits(path: Path | str) -> dict[str, ResponseLimits]:
    """Read limits that `save_several_limits` wrote, by name.

    Raises
    ------
    BalanceError
        The file is missing or contains no such limits.
    """

    def read(data: "xarray.Dataset") -> dict[str, ResponseLimits]:
        names = [str(name) for name in data["quantity"].values]
        return {name: read_limits_from_xarray(data.isel(quantity=number)) for number, name in enumerate(names)}

    return read_netcdf(path, "limits of several quantities: give a file that `save_several_limits`", read)
