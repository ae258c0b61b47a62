"""Jitter between repeats as effects with priors: the mean of a few repeats deviates in frequency and preload.

The covariance of a fit contains jitter as linear modes. A test on other repeats fits it instead, since near a sharp
resonance the curvature of a frequency shift exceeds the noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter

#: Largest relative difference between repeats of a frequency, of a force (the gain of an amplifier may be readjusted)
#: and of a preload, and a typical difference [-]. Two repeats that scatter by 3 % leave 12 % for their preload.
MOST_FREQUENCY, MOST_FORCE, MOST_PRELOAD, TYPICAL = 0.1, 0.5, 0.9, 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyShift:
    """Relative shift of the true frequency of all points of one configuration above the stated one."""

    configuration: str
    kind: str = "jitter"
    physics: str = "The exciter's frequency, or the temperature, differs from repeat to repeat."
    signature: str = "All resonance frequencies of a test shift by the same share."
    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(name="shift", unit="-", lower=-MOST_FREQUENCY, upper=MOST_FREQUENCY, typical=TYPICAL),
    )

    @property
    def name(self) -> str:
        """Name with the configuration."""
        return f"frequency of the {self.configuration} test"

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model at shifted frequencies."""
        (shift,) = values
        return model.with_frequency_shift(self.configuration, shift)


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceExcess:
    """Relative excess of the true force of all points of one configuration over the stated one."""

    configuration: str
    kind: str = "jitter"
    physics: str = "The amplifier, or the gain of its load cell, drifts from repeat to repeat."
    signature: str = "All readings of a test grow by the same factor, and slip begins earlier."
    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(name="excess", unit="-", lower=-MOST_FORCE, upper=MOST_FORCE, typical=TYPICAL),
    )

    @property
    def name(self) -> str:
        """Name with the configuration."""
        return f"force of the {self.configuration} test"

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model under a larger force."""
        (excess,) = values
        return model.with_force_error(self.configuration, excess)


@dataclass(frozen=True, kw_only=True, eq=False)
class PreloadJitter:
    """Simultaneous change of all preloads, each by its share of the amount."""

    shares: tuple[tuple[str, float], ...]
    name: str
    kind: str = "jitter"
    physics: str = "The preloads of the lines differ a little at each assembly."
    signature: str = "Mean normal forces and the onset of slip shift."
    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(name="amount", unit="-", lower=-MOST_PRELOAD, upper=MOST_PRELOAD, typical=TYPICAL),
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """Model with other preloads."""
        (amount,) = values
        for name, share in self.shares:
            if name in model.preloads:
                model = model.with_preload_ratio(name, 1 + share * amount)
        return model


def list_jitter(model: Model, covariances: Sequence[Float[NDArray[np.float64], "q q"]]) -> list[tuple[Effect, float]]:
    """Effects with the standard deviations of their parameters, for the blocks of `NuisanceModes.jitter`."""
    result: list[tuple[Effect, float]] = []
    singles = [kind(configuration=name) for kind in (FrequencyShift, ForceExcess) for name in ("jointed", "free")]
    for effect, covariance in zip(singles, covariances, strict=False):
        if covariance[0, 0] > 0:
            result.append((effect, float(np.sqrt(covariance[0, 0]))))
    if model.lines and len(covariances) > len(singles):
        result += list_preload_jitter(model, covariances[len(singles)])
    return result


def list_preload_jitter(
    model: Model, covariance: Float[NDArray[np.float64], "q q"]
) -> list[tuple[PreloadJitter, float]]:
    """Independent patterns of preload differences with their standard deviations.

    Parameters
    ----------
    model
        Model with its `preload_groups`.
    covariance
        Covariance of their relative differences, shape (q, q) [-].
    """
    sizes, vectors = np.linalg.eigh(covariance)
    return [
        (
            PreloadJitter(
                shares=tuple(
                    (name, float(share))
                    for group, share in zip(model.preload_groups, vector, strict=True)
                    for name in group
                ),
                name=f"preloads, pattern {number + 1}",
            ),
            float(np.sqrt(size)),
        )
        for number, (size, vector) in enumerate(zip(sizes, vectors.T, strict=True))
        if size > 0
    ]
