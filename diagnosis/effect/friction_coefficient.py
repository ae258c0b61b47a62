"""One contact line is rougher than the others."""

from correlation.model import Model
from diagnosis.candidate.contact_line import line_ratios
from diagnosis.candidate.effect import Effect, Untestable
from diagnosis.candidate.scale import Scale

KIND = "friction coefficient"


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The friction coefficient of each line; of two lines, their ratio.

    Parameters
    ----------
    model
        Whose lines.
    size
        Of the model; not asked for.
    """
    del size
    return line_ratios(
        model,
        kind=KIND,
        quantity="friction_coefficient",
        physics="One contact line has another friction coefficient than the others: wear, oxide, grease.",
        signature=(
            "Nothing while all contacts stick; at levels that slip the line's tangential force saturates at another "
            "value, while its normal force stays; nothing without contacts."
        ),
    )
