"""How far the loading history may have dragged the sliders.

Without a bound the question has no answer: bodies that friction alone holds can be dragged anywhere, and their contacts
jammed as hard as one likes. The box says how far they are from where the static load has left them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.balance import HarmonicBalance
from hbsolve.condensed import Condensed
from hbsolve.errors import BalanceError
from hbsolve.limits.sliders import cone, slider_table
from hbsolve.solution import solve_at
from hbsolve.state import slider_start
from reduction.array_input import real_number

Sliders = Float[NDArray[np.float64], " s"]

#: A slider this close to its bound is stopped by it, as a share of the reach.
ON_BOUND = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class SliderBox:
    """Initial slider states |w - nominal| <= reach.

    Parameters
    ----------
    nominal
        Shape (s,) [m].
    reach
        w_max, infinite for no box [m].
    radius
        mu N / k_t of each slider at rest: how far its spring stretches, shape (s,) [m].
    """

    nominal: Sliders
    reach: float
    radius: Sliders

    @property
    def bounded(self) -> bool:
        """Whether there is a bound."""
        return bool(np.isfinite(self.reach))

    @property
    def span(self) -> float:
        """A length by which sliders may be moved at a time, bounded or not [m]."""
        return self.reach if self.bounded else 4.0 * float(self.radius.mean())

    def clip(self, w: Sliders) -> Sliders:
        """The nearest state in the box."""
        return np.clip(w, self.nominal - self.reach, self.nominal + self.reach) if self.bounded else w

    def drift(self, w: Sliders) -> float:
        """Largest |w - nominal| [m]."""
        return float(np.abs(w - self.nominal).max())

    def active(self, w: Sliders) -> int:
        """How many sliders are at the bound."""
        return int((np.abs(w - self.nominal) >= (1 - ON_BOUND) * self.reach).sum()) if self.bounded else 0


def slider_box(
    balance: HarmonicBalance,
    condensed: Condensed,
    nominal: Sequence[float] | Sliders | None = None,
    reach: float | None = None,
) -> SliderBox:
    """A box about rest.

    Parameters
    ----------
    balance, condensed
        The system, and its structure at any frequency.
    nominal
        Centre, shape (s,) [m]; by default where the sliders are at rest under the static load, their springs without
        tension before it.
    reach
        w_max [m], infinite for none; by default the mean over all sliders of mu N / k_t at rest.

    Raises
    ------
    BalanceError
        A centre that does not fit, or a reach that is not positive.
    NoSteadyState
        There is no rest under the static load.
    """
    given = slider_start(balance, nominal)
    rest = solve_at(balance.at_level(0.0), condensed, None, given)
    interval = cone(rest.motion, slider_table(balance), balance.sampling.evaluate)
    radius = np.maximum(interval.high - interval.low, 0.0) / 2
    centre = given.value if nominal is not None else rest.slider_at_start
    wide = float(radius.mean()) if reach is None else real_number(reach, "reach", BalanceError)
    if not wide > 0:
        raise BalanceError(
            f"reach = {wide:g} m must be positive: it is how far sliders may have been dragged"
            + (" (by default mu N / k_t at rest, but no contact is pressed there)" if reach is None else "")
        )
    return SliderBox(nominal=np.array(centre), reach=wide, radius=radius)
