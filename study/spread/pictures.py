"""Figures of a spread: bands of curves and limits, and contributions to the variance."""

from collections.abc import Container

import numpy as np

from figure.response_spread import ResponseSpread, SpreadBand
from figure.style import LIMITS, choose_evenly
from figure.variance_shares import SharePanel, VarianceShares
from hbsolve.limits.result import SIDES
from study.solve.result import DISPLAY_UNIT
from study.spread.band import NINETY_PERCENT, limit_quantiles
from study.spread.quantity import limit_names
from study.spread.spread import Spread
from study.sweep.pictures import MOST_GROUPS, MOST_PANELS
from study.sweep.result import SampledLimits


def draw_spread(spread: Spread, title: str) -> dict[str, object]:
    """Make the figures, by name."""
    drawn: dict[str, object] = {}
    if spread.bands:
        drawn["spread_band"] = _make_curve_bands(spread, title)
    all_limits = spread.sampled.limits
    names = {item: limit_names(spread.sampled, item) for item in all_limits}
    others = {item.name for item in spread.quantities}.difference(*names.values())
    if (shares := _make_shares(spread, title, others)) is not None:
        drawn["spread_shares"] = shares
    for number, (item, own) in enumerate(names.items()):
        suffix = f"_{number + 1}" if len(names) > 1 else ""
        over = f"{title}: limits of the {item.first.quantity}"
        if spread.draws and len(item.first.limits.frequency) > 1:
            drawn[f"spread_limits{suffix}"] = _limit_bands(spread, item, over)
        if (shares := _make_shares(spread, over, own)) is not None:
            drawn[f"spread_limit_shares{suffix}"] = shares
    return drawn


def _describe_draws(spread: Spread) -> str:
    names = ", ".join(item.name for item in spread.uncertain.parameters)
    return f"{2 * spread.draws} draws of {names}" if spread.draws else f"{names} to first order"


def _make_curve_bands(spread: Spread, title: str) -> ResponseSpread:
    assert spread.sampled.curves is not None
    model = spread.sampled.curves.model
    output = model.outputs[0]
    unit, scale = DISPLAY_UNIT[output.quantity]
    panels = []
    for place in choose_evenly(len(model.curves), MOST_PANELS):
        band = spread.bands[place]
        nominal, reach = band.nominal[0], NINETY_PERCENT * band.deviation[0]
        panels.append(
            (
                model.curves[place].label,
                [
                    SpreadBand(
                        label="",
                        colour=LIMITS[0],
                        along=band.along,
                        quantiles=scale * band.quantiles[0],
                        nominal_along=band.nominal_along,
                        nominal=scale * nominal,
                        first_order=scale * np.array([nominal - reach, nominal + reach]),
                    )
                ],
            )
        )
    over_frequency = model.curves[0].parameter == "frequency"
    return ResponseSpread(
        panels=panels,
        along_label="frequency [Hz]" if over_frequency else "level of the harmonic force [-]",
        amplitude_label=f"amplitude [{unit}]",
        title=title,
        subtitle=f"{output.quantity} of {output.name}: {_describe_draws(spread)}",
    )


def _limit_bands(spread: Spread, limits: SampledLimits, title: str) -> ResponseSpread:
    first = limits.first
    quantiles = limit_quantiles(limits, len(spread.uncertain.parameters))
    frequency = first.limits.frequency
    panels = [
        (
            f"level {first.limits.level[level]:g}",
            [
                SpreadBand(
                    label=f"{SIDES[side]} limit",
                    colour=LIMITS[side],
                    along=frequency,
                    quantiles=quantiles[:, side, level],
                    nominal_along=frequency,
                    nominal=first.value[side, level],
                )
                for side in (1, 0)
            ],
        )
        for level in choose_evenly(len(first.limits.level), MOST_PANELS)
    ]
    return ResponseSpread(
        panels=panels, along_label="frequency [Hz]", amplitude_label=first.label, title=title,
        subtitle=_describe_draws(spread),
    )  # fmt: skip


def _make_shares(spread: Spread, title: str, names: Container[str]) -> VarianceShares | None:
    """Make the figure of contributions to the variance of the named quantities; None without quantities."""
    rows = [item for item in spread.quantities if item.name in names]
    curves = list(dict.fromkeys(item.curve for item in rows))
    shown = [curves[place] for place in choose_evenly(len(curves), MOST_GROUPS)] if curves else []
    if not shown:
        return None
    nothing = np.full(len(spread.uncertain.parameters), np.nan)
    panels = []
    for name in dict.fromkeys(item.name for item in rows):
        own = [item for item in rows if item.name == name and item.curve in shown]
        result = [item.indices for item in own]
        panels.append(
            SharePanel(
                label=f"of the {name}",
                first=np.array([nothing if item is None else item.first for item in result]),
                total=np.array([nothing if item is None else item.total for item in result]),
                interval=np.stack(
                    [np.array([nothing, nothing]) if item is None else item.total_interval for item in result], axis=1
                ),
                linear=np.array([item.linear_share for item in own]),
            )
        )
    return VarianceShares(
        panels=panels,
        groups=shown,
        parameters=[item.name for item in spread.uncertain.parameters],
        title=title,
        subtitle="contributions to the spread"
        + (f": {spread.draws * (2 + len(nothing))} points" if spread.draws else ": derivatives at the means"),
    )
