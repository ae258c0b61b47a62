"""Quantities of an uncertain response: statistics of draws, first-order deviation, contributions to the variance."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.uncertainty.variance_index import VarianceIndices, compute_variance_indices, take_independent_draws
from hbsolve.limits.result import SIDES
from study.solve.result import DISPLAY_UNIT
from study.spread.sensitivity import CurveSensitivity
from study.sweep.result import SampledCase, SampledLimits

Real = NDArray[np.float64]

#: Reported quantiles of the draws.
QUANTILES = (0.05, 0.5, 0.95)


@dataclass(frozen=True, kw_only=True, eq=False)
class QuantitySpread:
    """Spread of one quantity.

    Parameters
    ----------
    curve, name, unit
        Curve or level of the quantity, its name, and its unit.
    nominal
        Value at the means of all parameters.
    mean, deviation
        Mean and standard deviation of the draws; NaN without draws.
    quantiles
        Quantiles of the draws, shape (3,), at `QUANTILES`.
    slope
        Derivatives at the means, shape (d,) [unit / unit of the parameter]; NaN if unknown.
    first_order_deviation
        Standard deviation from the derivatives.
    linear_share
        Contribution of each parameter to the first-order variance, shape (d,) [-].
    indices
        Variance-based indices of the draws; None without draws.
    """

    curve: str
    name: str
    unit: str
    nominal: float
    mean: float
    deviation: float
    quantiles: Float[Real, "3"]
    slope: Float[Real, " d"]
    first_order_deviation: float
    linear_share: Float[Real, " d"]
    indices: VarianceIndices | None


def list_quantities(
    sampled: SampledCase, sensitivities: Sequence[CurveSensitivity], deviation: Float[Real, " d"]
) -> tuple[QuantitySpread, ...]:
    """List the spread of position, amplitude and damping of the first output's peaks, and of the peaks of limits.

    Parameters
    ----------
    sampled
        Results at the means, and then at all draws in the order of the design.
    sensitivities
        Derivatives of each curve at the means.
    deviation
        Standard deviations of the parameters, shape (d,).
    """
    rows = [*_list_curve_rows(sampled, sensitivities), *_limit_rows(sampled, len(deviation))]
    return tuple(_spread(*row, deviation) for row in rows)


_Row = tuple[str, str, str, Real, Real]


def _list_curve_rows(sampled: SampledCase, sensitivities: Sequence[CurveSensitivity]) -> Iterator[_Row]:
    if sampled.curves is None:
        return
    model = sampled.curves.model
    unit, scale = DISPLAY_UNIT[model.outputs[0].quantity]
    complete = np.array([[item.complete for item in point] for point in sampled.curves.curves])
    values = np.where(complete[..., None], sampled.curve_quantities()[:, :, 0, :3], np.nan)
    over_frequency = model.curves[0].parameter == "frequency"
    place = ("peak frequency", "Hz") if over_frequency else ("level of the peak", "-")
    for number, (curve, result) in enumerate(zip(model.curves, sensitivities, strict=True)):
        own, slope = values[:, number], result.peak[:, 0]
        yield curve.label, *place, own[:, 0], slope[:, 0]
        yield curve.label, "peak amplitude", unit, scale * own[:, 1], scale * slope[:, 1]
        yield curve.label, "equivalent damping ratio", "%", 100 * own[:, 2], np.full(len(slope), np.nan)


def _limit_rows(sampled: SampledCase, d: int) -> Iterator[_Row]:
    for item in sampled.limits:
        peaks = item.peaks()
        for level, scale in enumerate(item.first.limits.level):
            for name, values in zip(limit_names(sampled, item), peaks[:, :, level, 0].T, strict=True):
                yield f"level {scale:g}", name, item.first.unit, values, np.full(d, np.nan)


def limit_names(sampled: SampledCase, limits: SampledLimits) -> tuple[str, ...]:
    """Name the peaks of the lower and the upper limit, as quantities of the spread."""
    which = f" of the {limits.first.quantity}" if len(sampled.limits) > 1 else ""
    return tuple(f"{side} limit{which}" for side in SIDES)


def _spread(
    curve: str, name: str, unit: str, values: Real, slope: Float[Real, " d"], deviation: Float[Real, " d"]
) -> QuantitySpread:
    d, drawn = len(deviation), values[1:]
    own = np.array(take_independent_draws(drawn.tolist(), d))
    own = own[np.isfinite(own)]
    parts = (slope * deviation) ** 2
    return QuantitySpread(
        curve=curve,
        name=name,
        unit=unit,
        nominal=float(values[0]),
        mean=float(np.mean(own)) if len(own) else np.nan,
        deviation=float(np.std(own, ddof=1)) if len(own) > 1 else np.nan,
        quantiles=np.quantile(own, QUANTILES) if len(own) else np.full(3, np.nan),
        slope=slope,
        first_order_deviation=float(np.sqrt(parts.sum())),
        linear_share=parts / parts.sum() if parts.sum() > 0 else np.full(d, np.nan),
        indices=compute_variance_indices(drawn, d) if len(drawn) else None,
    )
