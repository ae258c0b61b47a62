"""Data of the figure of a plan."""

import numpy as np

from diagnosis.next_test.plan import CONFUSED, Plan
from figure.test_plan import PlanDrawing

#: Largest number of drawn effects, those that are detected best.
MAX_EFFECTS = 36


def make_plan_drawing(plan: Plan, title: str, subtitle: str) -> PlanDrawing:
    """Data of the figure: detectable strengths of effects, and cosines between their changes."""
    shown = plan.seen[:MAX_EFFECTS]
    n = len(shown)
    return PlanDrawing(
        title=title, subtitle=subtitle, names=[score.effect.name for score in shown],
        smallest=np.array([plan.relative(score) for score in shown]), cosines=plan.cosines[:n, :n], confused=CONFUSED,
    )  # fmt: skip
