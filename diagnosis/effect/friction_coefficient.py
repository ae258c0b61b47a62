"""One contact line is rougher than the others."""

from diagnosis.candidate.contact_line import make_line_ratio_kind
from diagnosis.effect import EFFECTS

EFFECTS.register(
    make_line_ratio_kind(
        "friction coefficient",
        "friction_coefficient",
        physics="One contact line has another friction coefficient than the others: wear, oxide, grease.",
        signature=(
            "No change while all contacts stick; at levels with slip the tangential force of the line saturates at "
            "another value, while its normal force is unchanged; no change without contacts."
        ),
        order=9,
        acts_by_slip_alone=True,
    )
)
