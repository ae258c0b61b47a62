"""Units and order of strengths in a list: alike for all effects of one kind."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from study.case.added import format_parameter, read_parameter
from study.diagnose.report import list_by_kind
from study.diagnose.table import Row, share_units

CUBIC = EffectParameter(name="stiffness", unit="N/m^3", lower=0.0, upper=1e15, typical=1e9)
MASS = EffectParameter(name="mass", unit="kg", lower=0.0, upper=1.0, typical=0.01)
TIME = EffectParameter(name="delay", unit="s", lower=-1e-3, upper=1e-3, typical=1e-5)


def row(name: str, parameter: EffectParameter, strength: float, detectable: float = np.inf) -> Row:
    effect: Any = SimpleNamespace(name=name, kind=name.split()[0], parameters=(parameter,))
    return Row(
        effect=effect, expected=1.0, gain=None, strength=strength, deviation=0.1 * abs(strength), errors=None,
        detectable=detectable, named=False,
    )  # fmt: skip


def test_effects_of_one_kind_are_written_in_the_unit_of_the_first() -> None:
    rows = share_units(
        [row("cubic at m0", CUBIC, 9.8e11), row("mass at m0", MASS, 0.0), row("cubic at m7", CUBIC, 1e8, 3e9),
         row("mass at m7", MASS, 0.02), row("mass at m1", MASS, -4e-5)]
    )  # fmt: skip
    assert [item.in_words for item in rows] == [
        "980 +- 190 N/mm^3", "0 g", "0.1 +- 0.02 N/mm^3", "20 +- 3.9 g", "-0.04 +- 0.0078 g"
    ]  # fmt: skip
    assert rows[2].detectable_in_words == "3 N/mm^3"


@pytest.mark.parametrize(("value", "text"), [(1.4e-5, "14 us"), (-2e-3, "-2 ms"), (1.5, "1.5 s")])
def test_a_short_time_is_written_in_a_handy_unit_and_read_again(value: float, text: str) -> None:
    assert format_parameter(value, TIME) == text
    if abs(value) < TIME.upper:
        assert read_parameter(text, TIME) == pytest.approx(value, rel=1e-12)  # round-off


def test_smallest_strengths_are_listed_by_kind() -> None:
    rows = share_units(
        [row("mass at m7", MASS, 0.0, 0.02), row("cubic at m0", CUBIC, 0.0, 2e9), row("mass at m1", MASS, 0.0, 0.004)]
    )
    assert list_by_kind(rows) == ["cubic: at m0 2 N/mm^3", "mass: at m1 4 g; at m7 20 g"]
