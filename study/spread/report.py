"""Report of ``stickslip spread``: a table of text and a JSON document."""

from math import isfinite
from typing import Any

from study.spread.quantity import QUANTILES, QuantitySpread
from study.spread.spread import Spread


def spread_document(spread: Spread) -> dict[str, Any]:
    """Make the document of ``--json``."""
    uncertain = spread.uncertain
    return {
        "parameters": [
            {
                "name": item.name,
                "unit": item.unit or "1",
                "is_factor": item.is_factor,
                "distribution": distribution.name,
                "mean": distribution.mean,
                "standard_deviation": distribution.deviation,
            }
            for item, distribution in zip(uncertain.parameters, uncertain.distributions, strict=True)
        ],
        "draws": spread.draws,
        "n_point": len(spread.sampled.values),
        "quantities": [_document_quantity(item) for item in spread.quantities],
        "files": [str(file) for file in spread.files],
    }


def _document_quantity(item: QuantitySpread) -> dict[str, Any]:
    result = item.indices
    return {
        "curve": item.curve,
        "quantity": item.name,
        "unit": item.unit,
        "at_the_means": item.nominal,
        "mean": item.mean,
        "standard_deviation": item.deviation,
        "quantiles": dict(zip(map(str, QUANTILES), item.quantiles.tolist(), strict=True)),
        "first_order_standard_deviation": item.first_order_deviation,
        "derivative": item.slope.tolist(),
        "first_order_share": item.linear_share.tolist(),
        "share": None if result is None else result.first.tolist(),
        "share_interval": None if result is None else result.first_interval.T.tolist(),
        "total_share": None if result is None else result.total.tolist(),
        "total_share_interval": None if result is None else result.total_interval.T.tolist(),
        "n_draw": 0 if result is None else result.n_draw,
    }


def format_spread_report(spread: Spread) -> str:
    """Format the report as a table."""
    uncertain = spread.uncertain
    lines = [f"{len(uncertain.parameters)} uncertain parameters, {len(spread.sampled.values)} points:"]
    for item, distribution in zip(uncertain.parameters, uncertain.distributions, strict=True):
        what = "factor on the case's values" if item.is_factor else "value in the case"
        numbers = f"mean {distribution.mean:.6g}, standard deviation {distribution.deviation:.4g} {item.unit}".rstrip()
        lines.append(f"  {item.name}, {what}: {distribution.name}, {numbers}")
    name_width = max(len(f"{item.name} [{item.unit}]") for item in spread.quantities)
    width = max(len("curve"), *(len(item.curve) for item in spread.quantities))
    lines += [
        "",
        f"  {'curve':<{width}}  {'quantity':<{name_width}}  {'at means':>9}  {'5 %':>9}  {'50 %':>9}  {'95 %':>9}  "
        f"{'deviation':>9}  {'1st order':>9}  Sobol index, first order / total",
    ]
    for row in spread.quantities:
        numbers = "  ".join(
            f"{value:9.4g}" if isfinite(value) else f"{'-':>9}"
            for value in (row.nominal, *row.quantiles, row.deviation, row.first_order_deviation)
        )
        name = f"{row.name} [{row.unit}]"
        lines.append(f"  {row.curve:<{width}}  {name:<{name_width}}  {numbers}  {_format_shares(spread, row)}")
    return "\n".join([*lines, "", *map(str, spread.files)])


def _format_shares(spread: Spread, row: QuantitySpread) -> str:
    names = [item.name for item in spread.uncertain.parameters]
    if row.indices is None:
        return ", ".join(f"{name} {share:.2f}" for name, share in zip(names, row.linear_share, strict=True))
    pairs = zip(names, row.indices.first, row.indices.total, strict=True)
    return ", ".join(f"{name} {first:.2f}/{total:.2f}" for name, first, total in pairs)
