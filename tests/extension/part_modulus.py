"""An effect from outside: one part is softer or stiffer than modelled."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind

RATIO = EffectParameter(name="modulus ratio", unit="-", lower=0.5, upper=2.0, typical=1.01, vanishes=1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Modulus:
    name: str
    part: str
    parameters: tuple[EffectParameter, ...] = (RATIO,)
    kind: str = "modulus"
    physics: str = "The part is softer or stiffer than modelled: another alloy, another heat treatment, its thickness."
    signature: str = "Resonances rise or fall by the same share at all levels; the missing force is that of a spring."

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        (ratio,) = values
        stiffness = model.system.stiffness
        for part in model.parts:
            if part.name == self.part:
                stiffness = stiffness + (ratio - 1) * part.stiffness
        return model.with_material(model.system.mass, stiffness)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    return [Modulus(name=f"modulus of {part.name}", part=part.name) for part in model.parts if part.stiffness.any()]


EFFECTS.register(
    EffectKind(
        name="modulus",
        acts_on="parts",
        physics=Modulus.physics,
        signature=Modulus.signature,
        parameters={RATIO.name: (RATIO.unit,)},
        candidates=candidates,
    )
)
