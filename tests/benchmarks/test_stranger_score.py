"""Rules by which diagnoses of strangers are scored."""

from typing import Any

import pytest

from benchmarks.strangers.score import is_first, is_wrong, n_found

MASS, GAIN, SPRING = "mass at tip", "gain of tip", "spring at tip"


def record(*rounds: dict[str, Any], hidden: tuple[str, ...] = (MASS,)) -> dict[str, Any]:
    effects = [{"name": name, "known": True} for name in hidden]
    return {"effects": effects, "rounds": [{"alike": {MASS: ["density of all"]}, **item} for item in rounds]}


def told(*names: str, further: str = "") -> dict[str, Any]:
    finding = "missing" if len(names) == 1 else "ambiguous"
    beside = {"name": further} if further else None
    return {"finding": finding, "named": [{"name": name} for name in names], "further": beside}


@pytest.mark.parametrize(
    ("verdict", "first", "wrong"),
    [
        (told(MASS), True, False),
        (told("density of all"), True, False),  # no data of this layout tell it from the mass
        (told(SPRING), False, True),
        (told(SPRING, MASS), False, False),
        (told(MASS, further=GAIN), True, True),
        (told(MASS, further="density of all"), True, True),  # one hidden effect under two names
        ({"finding": "unknown", "named": [], "further": None}, False, False),
    ],
)
def test_a_wrong_name_is_one_that_is_told_alone_or_beside(verdict: dict[str, Any], first: bool, wrong: bool) -> None:
    assert is_first(record(verdict)) is first
    assert is_wrong(record(verdict)) is wrong


@pytest.mark.parametrize(
    ("rounds", "count"),
    [
        ([told(MASS), told(GAIN)], 2),
        ([told(MASS, further=GAIN)], 2),
        ([told("density of all"), told(SPRING)], 1),
        ([told(SPRING, MASS)], 0),  # the first of several is added
        ([{"finding": "unknown", "named": [], "further": {"name": GAIN}}], 0),
    ],
)
def test_two_effects_are_found_in_rounds_or_beside_each_other(rounds: list[dict[str, Any]], count: int) -> None:
    result = record(*rounds, hidden=(MASS, GAIN))
    assert n_found(result) == count
    assert not is_wrong(record(told(MASS, further=GAIN), hidden=(MASS, GAIN)))
