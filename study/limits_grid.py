"""Whether a search for limits looks often enough: between two of its frequencies a resonance must not hide."""

from dataclasses import dataclass
from math import pi

import numpy as np

from fe.dense_modes import dense_modes
from reduction.stuck import stuck_stiffness
from study.limits_search import LimitSearch

#: A mode counts if its own peak at the output is at least this share of the largest in the band.
DRIVEN = 0.1


@dataclass(frozen=True, kw_only=True)
class NarrowResonance:
    """A resonance with all contacts stuck, narrower than the step between frequencies of the limits; all in Hz."""

    frequency: float
    width: float
    step: float

    def __str__(self) -> str:
        return (
            f"the limits' frequencies are {self.step:.3g} Hz apart at {self.frequency:.5g} Hz, where the resonance "
            f"with all contacts stuck is {self.width:.3g} Hz wide at half its power: limits hold at these frequencies "
            f"alone and may pass by its top; take a step of {self.width / 4:.2g} Hz"
        )


def narrow_resonance(search: LimitSearch) -> NarrowResonance | None:
    """The resonance within the band that its frequencies fit worst; None where all are wide enough.

    Parameters
    ----------
    search
        With a band of frequencies and an output; of contact forces nothing is said.
    """
    omega, system = np.array(search.angular_frequency), search.system
    if search.row is None or len(omega) < 2:
        return None
    modes = dense_modes(system.mass, stuck_stiffness(system.stiffness, system.joints))
    # Harmonic h drives a mode at the h-th part of its frequency.
    own = np.sqrt(modes.lambda_.clip(min=0)) / search.harmonic
    shapes = modes.mode_shapes
    driven = np.abs((search.row @ shapes) * (system.dynamic[search.harmonic] @ shapes))
    width = (
        np.einsum("rm,rs,sm->m", shapes, system.damping, shapes) / search.harmonic
    )  # 2 zeta omega, at half the power
    # Without damping a resonance has no width that a step could fit.
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
    frequency, width, apart = (float(each[worst]) / (2 * pi) for each in (own, width, step))
    return NarrowResonance(frequency=frequency, width=width, step=apart)
