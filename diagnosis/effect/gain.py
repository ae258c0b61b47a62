"""A sensor that reads too much or too little."""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "gain"
RATIO = EffectParameter(name="gain ratio", unit="-", lower=0.5, upper=2.0, typical=1.02, vanishes=1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Gain:
    """Scales the readings of one sensor."""

    name: str
    sensor: str
    parameters: tuple[EffectParameter, ...] = (RATIO,)
    kind: str = KIND
    physics: str = "The sensor reads too much or too little by a constant factor: its calibration or its amplifier."
    signature: str = (
        "Only one sensor is wrong, by the same factor at all levels, frequencies and harmonics, and in phase; all "
        "other sensors agree."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The sensor with its gain scaled; no change in a test without the sensor."""
        (ratio,) = values
        for sensor in model.sensors:
            if sensor.name == self.sensor:
                return model.with_sensor(self.sensor, gain=ratio * sensor.gain)
        return model


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The gain of each sensor."""
    del size
    if not model.sensors:
        return [Untestable(name=KIND, reason="the model has no sensors")]
    return [Gain(name=f"{KIND} of {sensor.name}", sensor=sensor.name) for sensor in model.sensors]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="sensors", physics=Gain.physics, signature=Gain.signature,
        parameters={RATIO.name: (RATIO.unit,)}, candidates=candidates, order=7,
    )
)  # fmt: skip
