"""One contact line is tangentially stiffer than the others."""

from correlation.model import Model
from diagnosis.candidate.contact_line import line_ratios
from diagnosis.candidate.effect import Effect, Untestable
from diagnosis.candidate.scale import Scale

KIND = "tangential stiffness"


def candidates(model: Model, size: Scale | None = None) -> list[Effect | Untestable]:
    """The tangential contact stiffness of each line; of two lines, their ratio.

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
        quantity="tangential_stiffness",
        physics="One contact line has another tangential stiffness than the others: less real area, other asperities.",
        signature=(
            "The tangential forces of the lines are shared otherwise from the lowest level on, where all contacts "
            "stick, and alike where they slip; nothing without contacts."
        ),
    )
