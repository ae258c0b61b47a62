"""A tilted head of a laser vibrometer."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.model import Model, Sensor
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "lean"
#: 5 degrees are visible, and beyond 45 the head measures another direction [rad].
ANGLE = EffectParameter(name="angle", unit="rad", lower=-0.8, upper=0.8, typical=0.09)


@dataclass(frozen=True, kw_only=True, eq=False)
class Lean:
    """Tilts one head of a sensor."""

    name: str
    sensor: str
    head: str
    parameters: tuple[EffectParameter, ...] = (ANGLE,)
    kind: str = KIND
    physics: str = (
        "The laser head is inclined: it reads less of the intended motion, and a part of the transverse motion."
    )
    signature: str = (
        "Only one sensor is wrong, by a share that is the same at all levels and depends on the deflection shape; "
        "stiffnesses from its loops are biased."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The head tilted by an additional angle; no change in a test without it."""
        (angle,) = values
        for sensor in model.sensors:
            if sensor.name == self.sensor and isinstance(sensor, Sensor) and self.head in sensor.heads:
                turned = sensor.leaning(self.head, angle)
                return model.with_sensor(self.sensor, row=turned.row, heads=turned.heads)
        return model


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The tilt of each head of each sensor with known heads."""
    del size
    result: list[Effect | Untestable] = [
        Lean(name=f"{KIND} of {sensor.name} at {head}", sensor=sensor.name, head=head)
        for sensor in model.sensors
        if isinstance(sensor, Sensor)
        for head in sensor.heads
    ]
    return result or [Untestable(name=KIND, reason="the model does not define how its sensors could be inclined")]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="heads of lasers", physics=Lean.physics, signature=Lean.signature,
        parameters={ANGLE.name: (ANGLE.unit,)}, candidates=candidates, order=15, has_two_sides=True,
    )
)  # fmt: skip
