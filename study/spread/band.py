"""Bands of curves and limits over uncertain parameters: quantiles of the draws at each frequency or level."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.uncertainty.variance_index import take_independent_draws
from study.spread.quantity import QUANTILES
from study.spread.sensitivity import CurveSensitivity
from study.sweep.result import SampledCase, SampledLimits

Real = NDArray[np.float64]

#: Number of points along a band.
PLACES = 401
#: Half width of a 90 % interval of a normal distribution, in standard deviations.
NINETY_PERCENT = 1.6448536269514722


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveBand:
    """The band of one curve, for each output.

    Parameters
    ----------
    along
        Frequency [Hz] or level [-], shape (q,), ascending.
    quantiles
        Amplitude at 5, 50 and 95 % of the draws, shape (n_output, 3, q) [SI]; empty without draws.
    nominal_along, nominal
        Frequency or level, and amplitude, of the curve at the means, shapes (p,) and (n_output, p).
    deviation
        Standard deviation of the amplitude to first order, shape (n_output, p) [SI].
    """

    along: Float[Real, " q"]
    quantiles: Float[Real, "output 3 q"]
    nominal_along: Float[Real, " p"]
    nominal: Float[Real, "output p"]
    deviation: Float[Real, "output p"]


def make_curve_bands(
    sampled: SampledCase, sensitivities: Sequence[CurveSensitivity], deviation: Float[Real, " d"]
) -> tuple[CurveBand, ...]:
    """Make the band of each curve; where the curve of a draw has several values, the highest one is used.

    Parameters
    ----------
    sampled
        Results at the means, and then at all draws in the order of the design.
    sensitivities
        Derivatives of each curve at the means.
    deviation
        Standard deviations of the parameters, shape (d,).
    """
    if sampled.curves is None:
        return ()
    drawn = take_independent_draws(sampled.curves.curves[1:], len(deviation))
    bands = []
    for number, result in enumerate(sensitivities):
        nominal = sampled.curves.curves[0][number]
        own = [point[number] for point in drawn if point[number].complete]
        along, quantiles = np.zeros(0), np.zeros((len(nominal.response), 3, 0))
        if own:
            # With the density of the points of the curves, which are close at the peaks.
            along = np.unique(np.quantile(np.concatenate([item.parameter for item in own]), np.linspace(0, 1, PLACES)))
            quantiles = np.array(
                [
                    np.nanquantile(
                        [compute_upper_envelope(item.parameter, np.abs(item.response[output]), along) for item in own],
                        QUANTILES, axis=0,
                    )
                    for output in range(len(nominal.response))
                ]
            )  # fmt: skip
        bands.append(
            CurveBand(
                along=along,
                quantiles=quantiles,
                nominal_along=nominal.parameter,
                nominal=np.abs(nominal.response),
                deviation=np.sqrt(np.einsum("dop,d->op", result.amplitude**2, deviation**2)),
            )
        )
    return tuple(bands)


def compute_upper_envelope(
    along: Float[Real, " p"], amplitude: Float[Real, " p"], places: Float[Real, " q"]
) -> Float[Real, " q"]:
    """Highest value of a piecewise linear curve at each place, shape (q,); NaN outside its range."""
    low, high = np.minimum(along[:-1], along[1:]), np.maximum(along[:-1], along[1:])
    highest = np.full(len(places), -np.inf)
    for piece in range(len(along) - 1):
        within = slice(
            int(np.searchsorted(places, low[piece])), int(np.searchsorted(places, high[piece], side="right"))
        )
        x, y = along[piece : piece + 2], amplitude[piece : piece + 2]
        order = np.argsort(x, kind="stable")
        highest[within] = np.maximum(highest[within], np.interp(places[within], x[order], y[order]))
    return np.where(np.isfinite(highest), highest, np.nan)


def limit_quantiles(limits: SampledLimits, d: int) -> Float[Real, "3 2 level f"]:
    """Compute quantiles of both limits over the draws, the lower limit first, shape (3, 2, l, f) [limits' unit]."""
    values = np.array([item.value for item in take_independent_draws(limits.points[1:], d)])
    known = np.isfinite(values).any(axis=0)
    return np.where(known, np.nanquantile(np.where(known, values, 0.0), QUANTILES, axis=0), np.nan)
