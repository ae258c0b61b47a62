r"""Measured force-displacement record and its features.

Features of each plateau of settled periods are the work per cycle, the secant stiffness and the mean of the forces at
both ends of the stroke; for a contact line in a vibrating structure also the amplitude of its motion.
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
#: Smallest relative standard deviation of a feature [-]: the calibration error of the two channels.
MIN_DEVIATION = 0.01


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceLoop:
    """Measured force-displacement record.

    Parameters
    ----------
    name
        Name in the manifest.
    displacement, force
        Signals, shape (n,) [m, N]. The force resists the displacement.
    loops
        Periods and plateaus of the record.
    frequency
        Frequency of the cycles [Hz].
    place
        Named place of the model whose displacement is imposed; None for a contact line.
    line
        Contact line of the measured tangential force; None for an imposed displacement.
    sensor
        Sensor of the displacement of a contact line; None for an imposed displacement.
    level
        Level of the force that drives the structure of a contact line [N]; None for an imposed displacement.
    held_out
        Whether it is held out of calibrations.
    removed_middle
        Middle of the strokes, which was subtracted from the displacement because its zero is unknown [m].
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
    removed_middle: float = 0.0

    def __post_init__(self) -> None:
        freeze_fields(self, "displacement", "force")

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of its sensors in the campaign."""
        return () if self.sensor is None else (self.sensor,)

    @property
    def suspicions(self) -> tuple[str, ...]:
        """Suspicions about the record, in words."""
        return self.loops.suspicions


def compute_loop_features(loop: ForceLoop) -> Features:
    """Features of each plateau."""
    label: list[str] = []
    unit: list[str] = []
    value: list[float] = []
    deviation: list[float] = []
    for plateau in loop.loops.plateaus:
        unit_of, factor = length_unit(plateau.amplitude[0])
        at = f"at {factor * plateau.amplitude[0]:.4g} {unit_of}"
        rows = [(name, getattr(plateau, name), f"{words} {at}", si, scale) for (name, words, si), scale in
                zip(FEATURES, _compute_scales(plateau), strict=True)]  # fmt: skip
        if loop.line is not None:
            rows.append(("amplitude", plateau.amplitude, "amplitude", "m", plateau.amplitude[0]))
        for name, (mean, scatter), words, si, scale in rows:
            label, unit = [*label, words], [*unit, si]
            value.append(mean)
            # A single period has no scatter; its closing error is used instead.
            chance = abs(plateau.closing_error[0]) * scale if plateau.n_period == 1 else scatter
            # The zero is uncertain by the subtracted middle, which shifts the force by that of the secant stiffness.
            shift = plateau.secant_stiffness[0] * loop.removed_middle if name == "force_offset" else 0.0
            deviation.append(float(np.linalg.norm([chance, MIN_DEVIATION * scale, shift])))
    return Features(label=tuple(label), unit=tuple(unit), value=np.array(value), deviation=np.array(deviation))


def describe_periods(loop: ForceLoop) -> str:
    """Describe which periods of a record are used for features, by amplitude, and which are left out."""
    loops = loop.loops
    unit, factor = length_unit(max(plateau.amplitude[0] for plateau in loops.plateaus))
    used = ", ".join(
        f"{factor * plateau.amplitude[0]:.3g} {unit}" + (f" ({plateau.n_period})" if plateau.n_period > 1 else "")
        for plateau in loops.plateaus
    )
    left = factor * loops.amplitude[loops.plateau < 0]
    sentence = f"{len(loops.amplitude) - len(left)} of {len(loops.amplitude)} periods are used, of {used}"
    if len(left):
        span = f"{left.min():.3g}" if len(left) == 1 else f"{left.min():.3g} to {left.max():.3g}"
        sentence += f"; {len(left)} of {span} {unit} do not close, or follow a change of amplitude"
    if abs(loop.removed_middle) > MIN_DEVIATION * loops.plateaus[0].amplitude[0]:
        unit, factor = length_unit(abs(loop.removed_middle))
        sentence += f"; the middle of the strokes, {factor * loop.removed_middle:.3g} {unit}, is taken as zero"
    return sentence


def _compute_scales(plateau: Plateau) -> tuple[float, float, float]:
    """Magnitudes to which the uncertainties of the features in `FEATURES` are proportional."""
    force = abs(plateau.secant_stiffness[0]) * plateau.amplitude[0]
    work = np.pi * force * plateau.amplitude[0]  # of an ellipse with the amplitudes of displacement and force
    return max(abs(plateau.work[0]), MIN_DEVIATION * work), abs(plateau.secant_stiffness[0]), force


def length_unit(amplitude: float) -> tuple[str, float]:
    """Unit for an amplitude in text, and its factor from metres."""
    return ("mm", 1e3) if amplitude >= 1e-3 else ("um", 1e6)
