"""One contact line is tangentially stiffer than the others."""

from diagnosis.candidate.contact_line import make_line_ratio_kind
from diagnosis.effect import EFFECTS

EFFECTS.register(
    make_line_ratio_kind(
        "tangential stiffness",
        "tangential_stiffness",
        physics=(
            "One contact line has another tangential stiffness than the others: smaller real contact area, other "
            "asperities."
        ),
        signature=(
            "The tangential forces are distributed differently over the lines from the lowest level on, where all "
            "contacts stick, and equally where they slip; no change without contacts."
        ),
        order=10,
    )
)
