"""A dead weight whose wire is not vertical."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.candidate.wire import list_wires
from diagnosis.effect import EFFECTS, EffectKind

KIND = "inclination"
#: Largest angle that is not visible [rad].
STEEPEST = 0.5
#: Accuracy of a level held to a wire [rad].
TYPICAL = 0.02


@dataclass(frozen=True, kw_only=True, eq=False)
class Inclination:
    """Turns the wire of a dead weight."""

    name: str
    weight: str
    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(name="angle", unit="rad", lower=-STEEPEST, upper=STEEPEST, typical=TYPICAL),
    )
    kind: str = KIND
    physics: str = "The wire of the dead weight is not vertical: it pulls the body towards one of its contact lines."
    signature: str = (
        "Mean normal forces of the lines change at all levels, and so do tangential ones, which also depend on the "
        "friction history; responses change less; no change without contacts."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The wire inclined by an additional angle; no change in a test without the dead weight."""
        (angle,) = values
        return model.with_wire(self.weight, inclination=angle) if self.weight in model.dead_weights else model


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The inclination of each dead weight on a wire."""
    del size
    wires, left = list_wires(model, KIND)
    return [*(Inclination(name=f"{KIND} of {name}", weight=name) for name in wires), *left]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="dead weights on wires", physics=Inclination.physics,
        signature=Inclination.signature, parameters={"angle": ("rad",)}, candidates=candidates, order=14,
        acts_by_slip_alone=True, has_two_sides=True,
    )
)  # fmt: skip
