"""One contact line is rougher than the others."""

from correlation.model import Model
from diagnosis.candidate.contact_line import list_line_ratios
from diagnosis.candidate.effect import Effect, Untestable
from diagnosis.candidate.scale import Scale
from diagnosis.effect import EFFECTS, EffectKind

KIND = "friction coefficient"
PHYSICS = "One contact line has another friction coefficient than the others: wear, oxide, grease."
SIGNATURE = (
    "Nothing while all contacts stick; at levels that slip the line's tangential force saturates at another "
    "value, while its normal force stays; nothing without contacts."
)


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The friction coefficient of each line; of two lines, their ratio."""
    del size
    return list_line_ratios(
        model,
        kind=KIND,
        quantity="friction_coefficient",
        physics=PHYSICS,
        signature=SIGNATURE,
    )


EFFECTS.register(
    EffectKind(
        name=KIND, acts_on="contact lines", physics=PHYSICS, signature=SIGNATURE,
        parameters={"ratio": ("-",)}, candidates=candidates, order=8, is_rugged=True,
    )
)  # fmt: skip
