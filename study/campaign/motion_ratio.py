"""Ratios of two motions, such as transmissibilities, which are not responses to a force."""

import re

from correlation.file.quantity import MOTION_WORDS, OF_UNIT

#: Ratio of two units in brackets, or of a unit to itself; "µm/m" is a strain.
MOTION_RATIO = re.compile(r"\((.+)\)/\((.+)\)|(.+)/\3")
#: Reason why such a ratio is not used, and the remedy.
TRANSMISSIBILITY = (
    'a transmissibility: a ratio of motions, not a response to a force: write [drive] quantity = "base '
    'acceleration", and [[run]] with level = 1 and these ratios with unit = "m/s^2"'
)


def is_motion_ratio(unit: str) -> bool:
    """Whether a unit is that of a ratio of two motions, such as "(g_n)/(g_n)"."""
    match = MOTION_RATIO.fullmatch(unit)
    return match is not None and all(OF_UNIT.get(part) in MOTION_WORDS for part in match.groups() if part)
