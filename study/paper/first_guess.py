"""Section 4.1 and figure 12: first guesses of k_t and mu from loops and force ratios, with what biases them."""

from dataclasses import dataclass

import numpy as np

from correlation.signal.stick_slip import estimate_stick_slip
from study.paper.campaign import Reference


@dataclass(frozen=True, kw_only=True)
class FirstGuess:
    """First guesses.

    Parameters
    ----------
    peak_to_peak
        Slope from end to end of the loop at the lowest level, the paper's straight line [N/m].
    kt
        Slope of the stick part of the loop at the highest level [N/m].
    mu
        Largest |T / N| at the highest level, a lower bound [-].
    """

    peak_to_peak: float
    kt: float
    mu: float


def guess_first(reference: Reference) -> FirstGuess:
    """First guesses from the loops of a campaign.

    Parameters
    ----------
    reference
        Campaign with its loops.

    Raises
    ------
    CampaignError
        A loop without a settled period.
    """
    low, high = reference.loops
    ends = np.argmax(low.displacement), np.argmin(low.displacement)
    slope = np.diff(low.tangential[list(ends)]) / np.diff(low.displacement[list(ends)])
    # Two periods and a point: the loop closes on the settled period.
    x, f, n = (np.tile(item, 3) for item in (high.displacement, high.tangential, high.normal))
    sign = 1.0 if slope[0] > 0 else -1.0
    stick = estimate_stick_slip(x - x.mean(), sign * (f - f.mean()), n)
    return FirstGuess(
        peak_to_peak=float(abs(slope[0])),
        kt=stick.tangential_stiffness.value,
        mu=float(np.abs(high.tangential / high.normal).max()),
    )
