r"""Test of linearity without a model: whether the responses are proportional to the force over the levels.

The homogeneity index of a level is the distance of its frequency responses from those of the lowest level,

.. math:: h_l = \sqrt{\frac{\sum |H_l - H_1|^2 - \sum (\sigma_l^2 + \sigma_1^2)}{\sum |H_1|^2}}

less the contribution of noise. It detects nonlinearity, but not its cause; a drift between two tests, such as a change
of temperature, has the same effect unless a level is repeated.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtri

from correlation.errors import CampaignError
from geometry.read_only_array import freeze_fields

Levels = Float[NDArray[np.float64], " l"]

#: Significance level of a difference: share of sets of levels in which noise is as large [-].
CHANCE = 1e-3
#: Homogeneity indices below this value are irrelevant for a model [-].
NEGLIGIBLE = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class Linearity:
    """Homogeneity over levels.

    Parameters
    ----------
    level
        Levels, ascending, shape (l,) [N].
    index
        Homogeneity index of each level relative to the lowest, shape (l,) [-]; 0 for the lowest.
    noise
        Index that noise alone would give, shape (l,) [-].
    significant
        Whether noise explains neither the difference nor the index, shape (l,).
    sentence
        The result in words.
    """

    level: Levels
    index: Levels
    noise: Levels
    significant: NDArray[np.bool_]
    sentence: str

    def __post_init__(self) -> None:
        freeze_fields(self, "level", "index", "noise")
        freeze_fields(self, "significant", kind=np.bool_)


def check_linearity(level: Any, responses: Any, deviation: Any, unit: str = "N") -> Linearity:
    """Homogeneity of frequency responses measured at several levels at the same frequencies.

    Parameters
    ----------
    level
        Levels, shape (l,) [N].
    responses
        Response per force of each level, complex or amplitudes, shape (l, f) or (l, c, f).
    deviation
        Standard deviation of real and imaginary part, or of the amplitude, same shape.
    unit
        Unit of the levels.

    Raises
    ------
    CampaignError
        Fewer than two levels, inconsistent shapes, or no common frequency of two levels.
    """
    levels = np.asarray(level, dtype=np.float64)
    values, spread = np.asarray(responses), np.asarray(deviation, dtype=np.float64)
    if values.ndim < 2 or len(values) != len(levels) or len(levels) < 2 or values.shape != spread.shape:
        raise CampaignError(
            f"levels of shape {levels.shape} with responses of shape {values.shape} and deviations of shape "
            f"{spread.shape} "
            "say nothing about linearity: give two levels or more, a row per level"
        )
    order = np.argsort(levels)
    levels, values, spread = levels[order], values[order].reshape(len(order), -1), spread[order].reshape(len(order), -1)
    parts = 2 if np.iscomplexobj(values) else 1
    index, noise, significant = np.zeros(len(levels)), np.zeros(len(levels)), np.zeros(len(levels), dtype=bool)
    for place in range(1, len(levels)):
        both = np.isfinite(values[place]) & np.isfinite(values[0])
        if not both.any():
            raise CampaignError(
                f"levels {levels[0]:.6g} and {levels[place]:.6g} have no frequency in common: measure both at "
                "the same ones"
            )
        square = np.abs(values[place, both] - values[0, both]) ** 2
        variance = spread[place, both] ** 2 + spread[0, both] ** 2
        size = float((np.abs(values[0, both]) ** 2).sum())
        known = variance > 0
        statistic = float((square[known] / variance[known]).sum())
        noise[place] = np.sqrt(parts * variance.sum() / size)
        index[place] = np.sqrt(max(square.sum() - parts * variance.sum(), 0.0) / size)
        beyond = statistic > chdtri(parts * known.sum(), CHANCE) if known.any() else square.sum() > 0
        # A few readings with little noise may differ although the responses as a whole do not.
        significant[place] = bool(beyond) and index[place] > 0
    return Linearity(
        level=levels, index=index, noise=noise, significant=significant,
        sentence=_describe_levels(levels, index, noise, significant, unit),
    )  # fmt: skip


def _describe_levels(level: Levels, index: Levels, noise: Levels, significant: NDArray[np.bool_], unit: str) -> str:
    """Sentence on the levels that differ from the lowest one, with the size of the difference."""
    matter = np.flatnonzero(significant & (index > NEGLIGIBLE))
    if not len(matter):
        most = max(float(index[significant].max()) if significant.any() else 0.0, float(noise.max()))
        return (
            f"no level from {level[0]:.4g} to {level[-1]:.4g} {unit} differs from the lowest beyond its noise by more "
            f"than {NEGLIGIBLE:.0%}: linear as far as these data can tell ({most:.2g} of the response would not have "
            "been seen)"
            if noise.max() > NEGLIGIBLE
            else f"linear within {max(most, NEGLIGIBLE):.2g} of the response from {level[0]:.4g} to {level[-1]:.4g} "
            f"{unit}"
        )
    listed = ", ".join(f"{level[place]:.4g} {unit} by {index[place]:.2g}" for place in matter)
    return (
        f"not linear: responses per unit of force differ from those at {level[0]:.4g} {unit} beyond noise "
        f"({noise.max():.2g}) at {listed} of their size"
    )
