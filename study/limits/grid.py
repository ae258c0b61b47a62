"""Check of the frequencies of a search for limits: their step must not be wider than a resonance."""

from dataclasses import dataclass
from math import pi

import numpy as np

from fe.dense_modes import compute_dense_modes
from reduction.jointed_system import modal_damping
from reduction.stuck import stick_at_rest
from study.limits.model import LimitSearch
from study.limits.table import MOST_POINTS

#: Smallest peak of a checked mode at the output, relative to the largest in the band [-].
DRIVEN = 0.1


@dataclass(frozen=True, kw_only=True)
class NarrowResonance:
    """A resonance with stuck contacts that is narrower than the step between frequencies of the limits; all in Hz."""

    frequency: float
    width: float
    step: float
    band: float
    """Width of the range from the first to the last frequency."""

    def sentence(self, *, listed: bool) -> str:
        """Return a warning with the remedy, which depends on whether the frequencies are a list."""
        fit = self.width / 4
        remedy = f"take a step of {fit:.2g} Hz"
        if listed:
            remedy = f"give more frequencies there, {fit:.2g} Hz apart"
        elif self.band / fit > MOST_POINTS:
            remedy = f"search a narrow band there with a step of {fit:.2g} Hz"
        return (
            f"the limits' frequencies are {self.step:.3g} Hz apart at {self.frequency:.5g} Hz, where the resonance "
            f"with all contacts stuck that are closed at rest is {self.width:.3g} Hz wide at half power: limits hold "
            f"only at these frequencies and may miss the peak; {remedy}"
        )


def find_narrow_resonance(search: LimitSearch) -> NarrowResonance | None:
    """Find the resonance in the band with the largest ratio of step to width; None if no step exceeds a width.

    Parameters
    ----------
    search
        Search with a band of frequencies and an output; searches for contact forces are not checked.
    """
    omega, system = np.array(search.angular_frequency), search.system
    if search.row is None or len(omega) < 2:
        return None
    modes = compute_dense_modes(system.mass, stick_at_rest(system.stiffness, system.joints))
    # Harmonic h excites a mode at its frequency divided by h.
    natural, shapes = np.sqrt(modes.lambda_.clip(min=0)), modes.mode_shapes
    own = natural / search.harmonic
    driven = np.abs((search.row @ shapes) * (system.dynamic[search.harmonic] @ shapes))
    width = modal_damping(system, shapes, natural) / search.harmonic  # 2 zeta omega, at half the power
    # A resonance without damping has no width.
    inside = np.flatnonzero((own > omega[0]) & (own < omega[-1]) & (driven > 0) & (width > 0))
    if not len(inside):
        return None
    own, width, peak = own[inside], width[inside], driven[inside] / (width[inside] * own[inside])
    after = np.searchsorted(omega, own)
    step = omega[after] - omega[after - 1]
    share = np.where(peak >= DRIVEN * peak.max(), step / width, 0.0)
    worst = int(np.argmax(share))
    if share[worst] <= 1:
        return None
    frequency, half_power, apart = (float(item[worst]) / (2 * pi) for item in (own, width, step))
    band = float(omega[-1] - omega[0]) / (2 * pi)
    return NarrowResonance(frequency=frequency, width=half_power, step=apart, band=band)
