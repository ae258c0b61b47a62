"""The model that the hidden effects are looked for in."""

from functools import cache

from study.case.setup import Setup, read_case
from study.shipped_cases import BEAM


@cache
def setup() -> Setup:
    """Model, calibration parameters and numerical error under test: those of the shipped beam."""
    return read_case(BEAM).setup
