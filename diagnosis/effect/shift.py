"""A dead weight that is shifted from its place."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.candidate.wire import list_wires
from diagnosis.effect import EFFECTS, EffectKind

KIND = "shift"
#: A larger shift of the wire would be visible, and outside the body that it pulls [m].
FURTHEST = 0.01
#: Accuracy of an adjustment by eye [m].
TYPICAL = 5e-4


@dataclass(frozen=True, kw_only=True, eq=False)
class Shift:
    """Moves the wire of a dead weight along the body."""

    name: str
    weight: str
    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(name="shift", unit="m", lower=-FURTHEST, upper=FURTHEST, typical=TYPICAL),
    )
    kind: str = KIND
    physics: str = (
        "The wire of the dead weight is off its nominal position: one contact line of the body carries more of its "
        "load."
    )
    signature: str = (
        "Mean normal forces of the two lines change in opposite directions at all levels, and their sum is constant; "
        "responses hardly change; no change without contacts."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The wire moved by an additional shift; no change in a test without the dead weight."""
        (shift,) = values
        return model.with_wire(self.weight, shift=shift) if self.weight in model.dead_weights else model


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The shift of each dead weight on a wire."""
    del size
    wires, left = list_wires(model, KIND)
    return [*(Shift(name=f"{KIND} of {name}", weight=name) for name in wires), *left]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="dead weights on wires", physics=Shift.physics, signature=Shift.signature,
        parameters={"shift": ("m",)}, candidates=candidates, order=13, acts_by_slip_alone=True, has_two_sides=True,
    )
)  # fmt: skip
