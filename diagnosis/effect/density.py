"""Another density of a part."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "density"
RATIO = EffectParameter(name="density ratio", unit="-", lower=0.5, upper=2.0, typical=1.01, vanishes=1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Density:
    """Scales the mass of a part."""

    name: str
    part: str
    parameters: tuple[EffectParameter, ...] = (RATIO,)
    kind: str = KIND
    physics: str = "The part is heavier or lighter than modelled: another alloy, pores, a coating, or its dimensions."
    signature: str = (
        "Resonance frequencies fall by the same share at all levels; the missing inertia force (0 deg, exponent 1) is "
        "spread over the part like its mass."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """M + (ratio - 1) M of the part, and the damping proportional to its mass."""
        (ratio,) = values
        mass = model.system.mass
        for part in model.parts:
            if part.name == self.part:
                mass = mass + (ratio - 1) * part.mass
        changed = model.with_material(mass, model.system.stiffness)
        if self.part not in model.elastic_bodies:
            return changed
        # A compliance of the support added later must use the changed mass.
        body = model.elastic_bodies[self.part].scale_mass(ratio)
        return replace(changed, elastic_bodies={**model.elastic_bodies, self.part: body})


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The density of each part."""
    del size
    result: list[Effect | Untestable] = []
    for part in model.parts:
        name = f"{KIND} of {part.name}"
        if part.mass.any():
            result.append(Density(name=name, part=part.name))
        else:
            result.append(Untestable(name=name, reason="the part has no mass"))
    return result


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="parts", physics=Density.physics, signature=Density.signature,
        parameters={RATIO.name: (RATIO.unit,)}, candidates=candidates, order=3,
    )
)  # fmt: skip
