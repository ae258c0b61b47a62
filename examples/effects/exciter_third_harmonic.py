"""An effect of your own: the exciter's amplifier adds a third harmonic to its force."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter

SHARE = EffectParameter(name="share", unit="-", lower=-0.5, upper=0.5, typical=0.05)


@dataclass(frozen=True)
class ThirdHarmonic:
    name: str = "third harmonic of the exciter"
    kind: str = "exciter distortion"
    physics: str = "The exciter adds a force at three times the frequency, a fixed share of the wanted one."
    signature: str = "Third harmonics that stay the same share at all levels, and peak at a third of a resonance."
    parameters: tuple[EffectParameter, ...] = (SHARE,)

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        wanted = model.system.dynamic
        force = np.zeros((max(len(wanted), 4), wanted.shape[1]), dtype=complex)
        force[: len(wanted)] = wanted
        force[3] += values[0] * wanted[1]
        return model.with_system(harmonic_force=force)


def candidates(model: Model) -> list[Effect]:
    return [ThirdHarmonic()] if len(model.system.dynamic) > 1 else []
