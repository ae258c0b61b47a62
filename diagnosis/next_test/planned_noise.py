"""Noise of planned readings: that of the sensors of a campaign, or as stated in a plan."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.noise.variance import fit_two_shares
from correlation.prediction import Points
from diagnosis.fit.comparison import Comparison


@dataclass(frozen=True)
class NoiseLaw:
    """Standard deviation of each part of a reading: relative [-] and absolute [unit of the sensor]."""

    relative: float
    absolute: float


@dataclass(frozen=True, kw_only=True, eq=False)
class PlannedNoise:
    """Noise of sensors, in a single reading.

    Parameters
    ----------
    known
        Laws by sensor and harmonic.
    usual
        Law of the fundamental of an unknown sensor.
    """

    usual: NoiseLaw
    known: Mapping[tuple[str, int], NoiseLaw] = field(default_factory=dict)

    @classmethod
    def of_campaign(cls, train: Comparison) -> "PlannedNoise":
        """Noise of the sensors of a campaign; an unknown sensor has the largest noise of the motion sensors."""
        observed, features, k = train.observed, train.features, len(train.features.points)
        size = np.abs(observed.mean)
        deviation = train.noise[:k] / features.per_reading(observed.mean)[:k]
        result: dict[tuple[str, int], NoiseLaw] = {}
        motions: list[NoiseLaw] = []
        for name in np.unique(observed.points.sensor).tolist():
            for harmonic in np.unique(observed.points.harmonic[observed.points.sensor == name]).tolist():
                own = (observed.points.sensor == name) & (observed.points.harmonic == harmonic)
                own &= np.isfinite(deviation) & (deviation > 0)
                if not own.any():
                    continue
                law = _fit_law(size[own], deviation[own])
                result[name, harmonic] = law
                if harmonic == 1 and observed.motion[own].all():
                    motions.append(law)
        chosen = motions or [*result.values()]
        usual = NoiseLaw(max(law.relative for law in chosen), max(law.absolute for law in chosen))
        return cls(usual=usual, known=result)

    def deviation(
        self, points: Points, value: Complex[NDArray[np.complex128], " k"]
    ) -> Float[NDArray[np.float64], " k"]:
        """Standard deviation of each part of a reading at some points, shape (k,) [unit of its sensor]."""
        size, result = np.abs(value), np.zeros(len(points))
        keys = list(zip(points.sensor.tolist(), points.harmonic.tolist(), strict=True))
        for key in dict.fromkeys(keys):
            law = self.known.get(key) or self.known.get((key[0], 1)) or self.usual
            own = np.array([item == key for item in keys])
            result[own] = np.hypot(law.relative * size[own], law.absolute)
        return result


def _fit_law(size: NDArray[np.float64], deviation: NDArray[np.float64]) -> NoiseLaw:
    """Law v = a^2 |X|^2 + b^2 of deviations; they were pooled by such a law and hardly scatter about it."""
    scale = float(np.mean(size**2)) or 1.0
    shares = fit_two_shares(np.stack([size**2, np.full(len(size), scale)]), deviation**2, deviation**-4.0)
    return NoiseLaw(float(np.sqrt(shares[0])), float(np.sqrt(shares[1] * scale)))
