"""Whether a model is near enough to a structure for one effect to be what it lacks.

A resonance that is far from all those of the calibrated model is no matter of one effect: a support, a mass or a unit
is wrong, and many effects could mend that resonance alone.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.feature.observation import Observation
from correlation.model import Model
from fe.dense_modes import compute_dense_modes
from reduction.jointed_system import JointedSystem
from reduction.stuck import stick_at_rest

#: Relative distance of a measured resonance from those of a model that is far [-].
FAR = 0.1
#: Least ratio of a peak to both ends of its curve [-].
PEAK = 1.5


class FarResonance(NamedTuple):
    """A measured resonance, and the nearest one of the model [Hz]."""

    configuration: str
    measured: float
    nearest: float

    @property
    def sentence(self) -> str:
        """Both in words."""
        off = 100 * (self.nearest / self.measured - 1)
        return (
            f"The model is not close enough to be diagnosed: the {self.configuration} structure has a resonance near "
            f"{self.measured:.4g} Hz, and the nearest one of the calibrated model, at {self.nearest:.4g} Hz, is "
            f"{off:+.2g} % off."
        )


def find_far_resonance(observed: Observation, model: Model) -> FarResonance | None:
    """The measured resonance that is farthest from those of a model, if it is far.

    Parameters
    ----------
    observed
        Measurements; the lowest level of each configuration counts.
    model
        Calibrated model. A resonance of its jointed structure lies between those without and with its contacts stuck.
    """
    found = []
    for free, measured in _list_peaks(observed):
        low, high = _bracket(model.free().system if free else model.system)
        ends = np.where(measured < low, low, np.where(measured > high, high, measured))
        nearest = float(ends[np.argmin(np.abs(np.log(np.maximum(ends, 1e-300) / measured)))])
        found.append(FarResonance("free" if free else "jointed", measured, nearest))
    farthest = max(found, key=lambda each: abs(np.log(each.nearest / each.measured)), default=None)
    return None if farthest is None or abs(farthest.nearest / farthest.measured - 1) <= FAR else farthest


def _list_peaks(observed: Observation) -> Iterator[tuple[bool, float]]:
    """Configuration and frequency of the highest peak at its lowest level, of the sensor that moves most [Hz]."""
    points = observed.points
    size = np.abs(observed.value) / np.where(points.force > 0, points.force, 1.0)
    seen = observed.motion & (points.harmonic == 1) & np.isfinite(size)
    for free in np.unique(points.free[seen]).tolist():
        own = seen & (points.free == free)
        own &= points.level == points.level[own].min()
        own &= points.sensor == points.sensor[own][np.argmax(size[own])]
        own &= points.sweep == points.sweep[own][0]
        rows = np.flatnonzero(own)[np.argsort(points.frequency[own])]
        curve = size[rows]
        if curve.max() > PEAK * max(curve[0], curve[-1]):
            yield bool(free), float(points.frequency[rows[np.argmax(curve)]])


def _bracket(system: JointedSystem) -> tuple[Float[NDArray[np.float64], " r"], Float[NDArray[np.float64], " r"]]:
    """Natural frequencies without contacts and with all of them stuck, one by one the lower and the higher [Hz]."""
    low, high = (
        compute_dense_modes(system.mass, stiffness).frequency
        for stiffness in (system.stiffness, stick_at_rest(system.stiffness, system.joints))
    )
    return low, np.maximum(low, high)
