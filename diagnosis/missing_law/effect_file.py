"""A recovered law as a file that defines a user effect; it can be run unchanged or edited."""

import numpy as np

from diagnosis.missing_law.curves import LawCurves
from diagnosis.missing_law.description import LawDescription
from diagnosis.missing_law.place_law import PlaceLaw

#: Significant digits of the numbers in the file.
DIGITS = 6
#: Cells whose limit is below this share of the largest force are omitted [-].
SMALL_CELL = 1e-6

TEMPLATE = '''"""The missing law at `PLACE`, recovered from measurements: {words}.

Its strength is 1 for the law as it was recovered. Forces are {units.force}, displacements {units.motion},
velocities {units.speed}.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from correlation.model import Model
from diagnosis.candidate.effect import Effect, EffectParameter
from reduction.jointed_system import JenkinsChain, PiecewiseDamper, PiecewiseSpring

PLACE = {place!r}
#: Pieces of the springs [{units.motion}] with the change of their stiffness at each kink, for u > 0 and u < 0
#: [{units.stiffness}].
WIDTH = {width}
AHEAD = {ahead}
BACK = {back}
#: The same of the damper [{units.speed}, {units.damping}].
SPEED = {speed}
DAMPING = {damping}
#: Stiffness [{units.stiffness}] and limit [{units.force}] of each Jenkins cell.
CELLS = {cells}
STRENGTH = EffectParameter(name="ratio", unit="-", lower=0.0, upper=10.0, typical=1.0)


@dataclass(frozen=True)
class RecoveredLaw:
    name: str = f"recovered law at {{PLACE}}"
    kind: str = "recovered law"
    physics: str = {physics!r}
    signature: str = "As the recovered law describes."
    parameters: tuple[EffectParameter, ...] = (STRENGTH,)

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        ratio, row, name = values[0], find_rows(model)[PLACE], self.name
        joints = [
            PiecewiseSpring(name=f"{{name}} ahead", direction=row, width=WIDTH, stiffness=[ratio * k for k in AHEAD]),
            PiecewiseSpring(name=f"{{name}} back", direction=-row, width=WIDTH, stiffness=[ratio * k for k in BACK]),
            PiecewiseDamper(name=f"{{name}} damper", direction=row, width=SPEED, damping=[ratio * c for c in DAMPING]),
        ]
        if CELLS:
            # A cell of the balance has a stiffness.
            stiffness, limit = ([max(ratio, 1e-9) * value for value in each] for each in zip(*CELLS))
            joints.append(
                JenkinsChain(name=f"{{name}} cells", direction=row, tangential_stiffness=stiffness, limit_force=limit)
            )
        return model.with_system(joints=[*model.system.joints, *joints])


def find_rows(model: Model) -> dict:
    sensors = {{each.name: each.row for each in model.sensors if hasattr(each, "row")}}
    return {{**sensors, **model.places}}


def candidates(model: Model) -> list[Effect]:
    return [RecoveredLaw()] if PLACE in find_rows(model) else []
'''


def write_effect_file(law: PlaceLaw, curves: LawCurves, words: LawDescription) -> str:
    """Text of a Python file that defines the law as an effect at its place of the model.

    Parameters
    ----------
    law, curves, words
        The law, its curves, and their description.
    """
    ahead, back, damping = law.basis.pieces(law.posterior.mean)
    stiffness, limit = law.basis.cells(law.posterior.mean)
    least = SMALL_CELL * max(float(np.abs(loop.force.mean).max()) for loop in curves.loops)
    cells = [(_round(k), _round(f)) for k, f in zip(stiffness, limit, strict=True) if f > least]
    sentence = words.sentences[0] if words.sentences else "a force"
    return TEMPLATE.format(
        place=law.name, words=", ".join(words.words) or "no clear features", physics=f"A force: {sentence}.",
        units=law.units, width=_round(law.basis.width), speed=_round(law.basis.width_of_speed), cells=cells,
        ahead=[_round(item) for item in ahead], back=[_round(item) for item in back],
        damping=[_round(item) for item in damping],
    )  # fmt: skip


def _round(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
