"""What is drawn of a plan."""

import numpy as np

from diagnosis.next_test.plan import CONFUSED, Plan
from figure.test_plan import PlanDrawing

#: Effects that are drawn at most, those that are seen best.
MAX_EFFECTS = 36


def make_plan_drawing(plan: Plan, title: str, subtitle: str) -> PlanDrawing:
    """Detectable strengths, and how alike effects look."""
    shown = plan.seen[:MAX_EFFECTS]
    n = len(shown)
    return PlanDrawing(
        title=title, subtitle=subtitle, names=[score.effect.name for score in shown],
        smallest=np.array([plan.relative(score) for score in shown]), cosines=plan.cosines[:n, :n], confused=CONFUSED,
    )  # fmt: skip
