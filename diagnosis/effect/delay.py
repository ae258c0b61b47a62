"""A sensor that reads too late or too early."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter, Untestable
from diagnosis.candidate.scale import Scale, measure_scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "delay"
#: Typical and largest phase shift at the highest of the first resonances [rad].
TYPICAL, LARGEST = 0.02, pi / 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Delay:
    """Shifts the phase of the readings of one sensor by k Omega tau."""

    name: str
    sensor: str
    parameters: tuple[EffectParameter, ...]
    kind: str = KIND
    physics: str = (
        "The signal of the sensor is delayed or advanced by a constant time: an anti-alias filter, an amplifier, or a "
        "channel that is not simultaneous with the force."
    )
    signature: str = (
        "The phase error of one sensor is proportional to the frequency, equal at all levels, and k times as large in "
        "harmonic k; amplitudes and all other sensors agree."
    )

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        """The sensor with an added delay; no change in a test without the sensor."""
        (late,) = values
        for sensor in model.sensors:
            if sensor.name == self.sensor:
                return model.with_sensor(self.sensor, delay=sensor.delay + late)
        return model


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The delay of each sensor."""
    if not model.sensors:
        return [Untestable(name=KIND, reason="the model has no sensors")]
    resonances = (size or measure_scale(model)).resonances
    radian = 1 / max(item.angular_frequency for item in resonances)
    parameter = EffectParameter(
        name="delay", unit="s", lower=-LARGEST * radian, upper=LARGEST * radian, typical=TYPICAL * radian
    )
    return [
        Delay(name=f"{KIND} of {sensor.name}", sensor=sensor.name, parameters=(parameter,)) for sensor in model.sensors
    ]


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="sensors", physics=Delay.physics, signature=Delay.signature,
        parameters={"delay": ("s",)}, candidates=candidates, order=8,
    )
)  # fmt: skip
