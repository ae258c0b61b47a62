"""One contact line is tangentially stiffer than the others."""

from correlation.model import Model
from diagnosis.candidate.contact_line import list_line_ratios
from diagnosis.candidate.effect import Effect, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "tangential stiffness"
PHYSICS = "One contact line has another tangential stiffness than the others: less real area, other asperities."
SIGNATURE = (
    "The tangential forces of the lines are shared otherwise from the lowest level on, where all contacts "
    "stick, and alike where they slip; nothing without contacts."
)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The tangential contact stiffness of each line; of two lines, their ratio."""
    del size
    return list_line_ratios(
        model,
        kind=KIND,
        quantity="tangential_stiffness",
        physics=PHYSICS,
        signature=SIGNATURE,
    )


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="contact lines", physics=PHYSICS, signature=SIGNATURE,
        parameters={"ratio": ("-",)}, candidates=candidates, order=9,
    )
)  # fmt: skip
