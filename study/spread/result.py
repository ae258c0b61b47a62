"""The spread of a response as netCDF and CSV."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from study.spread.band import limit_quantiles
from study.spread.quantity import QUANTILES, QuantitySpread
from study.spread.spread import Spread
from study.sweep.result import make_dataset, write_csv

if TYPE_CHECKING:
    import xarray as xr


def format_quantities_csv(spread: Spread) -> str:
    """Format one line per quantity and parameter."""
    head = ["curve", "quantity", "unit", "at the means", "mean", "standard deviation"]
    head += [f"{100 * share:g} %" for share in QUANTILES]
    head += ["standard deviation to first order", "parameter", "derivative", "share to first order"]
    head += ["share by itself", "share by itself, low", "share by itself, high"]
    head += ["share with interactions", "share with interactions, low", "share with interactions, high"]

    def lines() -> Iterable[list[str]]:
        for item in spread.quantities:
            numbers = [item.nominal, item.mean, item.deviation, *item.quantiles, item.first_order_deviation]
            for number, parameter in enumerate(spread.uncertain.parameters):
                own = [item.slope[number], item.linear_share[number], *_list_shares(item, number)]
                texts = ([f"{value:.10g}" for value in part] for part in (numbers, own))
                first, second = texts
                yield [item.curve, item.name, item.unit, *first, parameter.label, *second]

    return write_csv(head, lines())


def _list_shares(item: QuantitySpread, number: int) -> list[float]:
    result = item.indices
    if result is None:
        return [np.nan] * 6
    parts = ((result.first, result.first_interval), (result.total, result.total_interval))
    return [float(x) for value, interval in parts for x in (value[number], *interval[:, number])]


def make_spread_dataset(spread: Spread, title: str) -> "xr.Dataset":
    """Make a dataset of `make_dataset` for all points, with derivatives, bands and variance indices; SI units."""
    data = make_dataset(spread.sampled, title)
    for number, (band, result) in enumerate(zip(spread.bands, spread.sensitivities, strict=True)):
        along, places = f"along_{number}", f"place_{number}"
        data = data.assign(
            {
                f"mean_curve_{number}": (("output", along), band.nominal),
                f"mean_curve_derivative_{number}": (("parameter", "output", along), result.amplitude),
                f"mean_curve_deviation_{number}": (("output", along), band.deviation),
                f"band_{number}": (("output", "quantile", places), band.quantiles),
            }
        ).assign_coords({along: band.nominal_along, places: band.along})
    data = data.assign_coords(quantile=np.array(QUANTILES))
    if spread.sampled.limits and spread.draws:
        d = len(spread.uncertain.parameters)
        quantiles = np.array([limit_quantiles(item, d) for item in spread.sampled.limits])
        dimensions = ("limit_quantity", "quantile", "side", "limit_level", "limit_frequency")
        data = data.assign(limit_band=(dimensions, quantiles))
    rows, shape = spread.quantities, (len(spread.quantities), len(spread.uncertain.parameters))
    shares = [[_list_shares(item, number) for number in range(shape[1])] for item in rows]
    table = np.array(shares).reshape(*shape, 6)
    both = ("quantity", "parameter")
    return data.assign(
        nominal=("quantity", np.array([item.nominal for item in rows])),
        mean=("quantity", np.array([item.mean for item in rows])),
        deviation=("quantity", np.array([item.deviation for item in rows])),
        first_order_deviation=("quantity", np.array([item.first_order_deviation for item in rows])),
        derivative=(both, np.array([item.slope for item in rows])),
        first_order_share=(both, np.array([item.linear_share for item in rows])),
        share=(both, table[..., 0]),
        share_interval=((*both, "end"), table[..., 1:3]),
        total_share=(both, table[..., 3]),
        total_share_interval=((*both, "end"), table[..., 4:6]),
    ).assign_coords(
        quantity=np.array([f"{item.curve}: {item.name}" for item in rows], dtype=object),
        quantity_unit=("quantity", np.array([item.unit for item in rows], dtype=object)),
    )
