"""One contact line is tangentially stiffer than the others."""

from diagnosis.candidate.contact_line import make_line_ratio_kind
from diagnosis.effect import EFFECTS

EFFECTS.register(
    make_line_ratio_kind(
        "tangential stiffness",
        "tangential_stiffness",
        physics="One contact line has another tangential stiffness than the others: less real area, other asperities.",
        signature=(
            "The tangential forces of the lines are shared otherwise from the lowest level on, where all contacts "
            "stick, and alike where they slip; nothing without contacts."
        ),
        order=10,
    )
)
