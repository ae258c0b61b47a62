"""Figure of a recovered law."""

import numpy as np

from diagnosis.missing_law.curves import CurveWithBand
from figure.missing_law import BandedCurve, KnownLaw, LawDrawing, LevelLoop
from study.diagnose.missing_law import RecoveredLaw

#: Powers of the displacement that are drawn next to a law.
POWERS = {"linear": 1, "cubic": 3}


def make_law_drawing(law: RecoveredLaw, title: str) -> LawDrawing:
    """Loops, curves and bands of a law, with the nearest known springs."""
    curves, x = law.curves, law.curves.spring.x
    known = []
    for name, power in POWERS.items():
        shape = np.sign(x) * np.abs(x) ** power
        known.append(KnownLaw(label=f"nearest {name}", force=shape * (shape @ curves.spring.mean) / (shape @ shape)))
    return LawDrawing(
        title=title, subtitle=law.sentences[0],
        loops=[
            LevelLoop(
                label=f"{loop.level:g} N", displacement=loop.displacement, velocity=loop.velocity, force=loop.force.mean
            )
            for loop in curves.loops
        ],
        spring=_make_band(curves.spring), damper=_make_band(curves.damper), stiffness=_make_band(curves.stiffness),
        work=_make_band(curves.work), known=known, is_hatched=not curves.sees_even,
        motion_unit=curves.units.motion, force_unit=curves.units.force,
    )  # fmt: skip


def _make_band(curve: CurveWithBand) -> BandedCurve:
    return BandedCurve(x=curve.x, mean=curve.mean, low=curve.low, high=curve.high)
