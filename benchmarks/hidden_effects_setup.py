"""Model of the hidden-effect test."""

from functools import cache

from study.case.setup import Setup, read_case
from study.shipped_cases import BEAM


@cache
def setup() -> Setup:
    """Model, calibration parameters and numerical error of the shipped beam."""
    return read_case(BEAM).setup
