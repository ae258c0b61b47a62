r"""A measured force-displacement record, and its features.

Features of each plateau of settled periods are the work per cycle, the secant stiffness and the middle of the forces at
both ends of the stroke; of a contact line in a vibrating structure also the amplitude of its motion.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.data_type.registry import Features
from correlation.signal.loop import Loops, Plateau
from geometry.read_only_array import freeze_fields

Signal = Float[NDArray[np.float64], " n"]
Numbers = Float[NDArray[np.float64], " m"]

#: Features of a plateau, with their units.
FEATURES = (
    ("work", "work per cycle", "J"),
    ("secant_stiffness", "secant stiffness", "N/m"),
    ("force_offset", "middle of the force", "N"),
)
#: Least standard deviation of a feature [-]: what a calibration of the two channels leaves.
LEAST = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceLoop:
    """A measured force-displacement record.

    Parameters
    ----------
    name
        As in the manifest.
    displacement, force
        Signals, shape (n,) [m, N]. The force resists the displacement.
    loops
        Periods and plateaus of the record.
    frequency
        Of the cycles [Hz].
    place
        Named place of the model whose displacement is imposed; None for a contact line.
    line
        Contact line whose tangential force it is; None for an imposed displacement.
    sensor
        Sensor of the displacement of a contact line; None for an imposed displacement.
    level
        Level of the force that drives the structure of a contact line [N]; None for an imposed displacement.
    held_out
        Whether no calibration may see it.
    """

    type: ClassVar[str] = "force-displacement loop"
    name: str
    displacement: Signal
    force: Signal
    loops: Loops
    frequency: float
    place: str | None = None
    line: str | None = None
    sensor: str | None = None
    level: float | None = None
    held_out: bool = False

    def __post_init__(self) -> None:
        freeze_fields(self, "displacement", "force")

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of sensors of the campaign that it uses."""
        return () if self.sensor is None else (self.sensor,)

    @property
    def suspicions(self) -> tuple[str, ...]:
        """Suspicions about the record, in words."""
        return self.loops.suspicions


def loop_features(loop: ForceLoop) -> Features:
    """Numbers of each plateau."""
    label: list[str] = []
    unit: list[str] = []
    value: list[float] = []
    deviation: list[float] = []
    for plateau in loop.loops.plateaus:
        unit_of, factor = length_unit(plateau.amplitude[0])
        at = f"at {factor * plateau.amplitude[0]:.4g} {unit_of}"
        rows = [(getattr(plateau, name), f"{words} {at}", si, scale) for (name, words, si), scale in
                zip(FEATURES, _scales(plateau), strict=True)]  # fmt: skip
        if loop.line is not None:
            rows.append((plateau.amplitude, "amplitude", "m", plateau.amplitude[0]))
        for (mean, scatter), words, si, scale in rows:
            label, unit = [*label, words], [*unit, si]
            value.append(mean)
            deviation.append(float(np.hypot(np.nan_to_num(scatter), LEAST * scale)))
    return Features(label=tuple(label), unit=tuple(unit), value=np.array(value), deviation=np.array(deviation))


def _scales(plateau: Plateau) -> tuple[float, float, float]:
    """Sizes that the features of a plateau are uncertain in proportion to: those of the loop as a whole."""
    force = abs(plateau.secant_stiffness[0]) * plateau.amplitude[0]
    work = np.pi * force * plateau.amplitude[0]  # of an ellipse as wide as the stroke and as high as the force
    return max(abs(plateau.work[0]), LEAST * work), abs(plateau.secant_stiffness[0]), force


def length_unit(amplitude: float) -> tuple[str, float]:
    """Unit that an amplitude is written in, and its factor from metres."""
    return ("mm", 1e3) if amplitude >= 1e-3 else ("um", 1e6)
