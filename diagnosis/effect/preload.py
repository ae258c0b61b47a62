"""The preload of one contact line, or of one dead weight, differs from the model."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.model import Model
from diagnosis.candidate.contact_line import find_contacts
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "preload"
RATIO = EffectParameter(name="preload ratio", unit="-", lower=0.1, upper=3.0, typical=1.1, vanishes=1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Preload:
    """Scales the preload of a line together with the load that balances it; or scales a dead weight.

    Parameters
    ----------
    target
        One of `Model.preloads`.
    """

    name: str
    target: str
    parameters: tuple[EffectParameter, ...] = (RATIO,)
    kind: str = KIND
    physics: str = "The preload of the contact line differs from the model: bolts, dead weights, assembly."
    signature: str = (
        "The mean normal force of the line differs at all levels; slip and lift-off begin at another level, so that "
        "its tangential force saturates at another value; no change without contacts."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """N_0 of each contact times the ratio, and the static load along its normal; or the load of the dead weight."""
        (ratio,) = values
        # The structure without contacts has no preloads.
        return model.with_preload_ratio(self.target, ratio) if self.target in model.preloads else model


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The preload of each line, and by each dead weight."""
    del size
    if not model.lines:
        return [Untestable(name=KIND, reason="the model has no contact lines")]
    result: list[Effect | Untestable] = []
    for target in model.preloads:
        name = f"{KIND} {'by' if target in model.dead_weights else 'of'} {target}"
        if target in model.dead_weights or any(item.preload for item in find_contacts(model, target)):
            result.append(Preload(name=name, target=target))
        else:
            result.append(Untestable(name=name, reason="it is zero in the model, and a ratio cannot change zero"))
    return result


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="contact lines and dead weights", physics=Preload.physics, signature=Preload.signature,
        parameters={RATIO.name: (RATIO.unit,)}, candidates=candidates, order=11, acts_by_slip_alone=True,
    )
)  # fmt: skip
