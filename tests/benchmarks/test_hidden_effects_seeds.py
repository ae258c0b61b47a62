"""Two of the score's campaigns, whole: made on the bench, diagnosed with the shipped limits, put on record."""

from pathlib import Path

import pytest

from benchmarks.hidden_effects_campaign import examine
from benchmarks.hidden_effects_groups import read_groups
from benchmarks.hidden_effects_plan import Case
from benchmarks.hidden_effects_record import MISSING, NONE


@pytest.mark.parametrize(
    ("row", "seed", "finding", "effects"),
    [
        ("cubic", 72005, MISSING, ("cubic at tip",)),
        ("nothing", 77003, NONE, ()),
    ],
)
def test_a_campaign_of_the_score_is_judged_as_it_should_be(
    row: str, seed: int, finding: str, effects: tuple[str, ...], tmp_path: Path
) -> None:
    record = examine(Case(row=row, seed=seed), tmp_path, read_groups())
    assert (record.failure, record.finding, record.names) == ("", finding, effects)
    if effects:
        assert record.planted.effect in effects
        named = record.named[0]
        assert named.strength == pytest.approx(record.planted.value, abs=4 * named.deviation)
