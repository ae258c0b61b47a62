"""The level of a case: a scale of its harmonic loads."""

from typing import Annotated

from pydantic import AfterValidator, Field

from casefile.quantity import Ratio

#: Levels beyond these are mistakes; the arithmetic of a motion would overflow far beyond them.
LEAST_LEVEL, MOST_LEVEL = 1e-12, 1e12


def _in_range(level: float) -> float:
    if not LEAST_LEVEL <= level <= MOST_LEVEL:
        raise ValueError(f"must lie between {LEAST_LEVEL:g} and {MOST_LEVEL:g}: it scales the loads, so change those")
    return level


Level = Annotated[Ratio, Field(gt=0), AfterValidator(_in_range)]
