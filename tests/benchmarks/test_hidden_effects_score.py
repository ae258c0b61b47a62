"""The score of the test of hidden effects on records made by hand."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.hidden_effects_confusion import AMONG, APART, ELSEWHERE, confusion
from benchmarks.hidden_effects_groups import Groups, groups_of, read_groups
from benchmarks.hidden_effects_plan import APART as BETWEEN_ROWS
from benchmarks.hidden_effects_plan import EXCLUDED, PLANTED, cases
from benchmarks.hidden_effects_record import (
    AMBIGUOUS,
    FAILED,
    MISSING,
    NONE,
    UNKNOWN,
    Fitted,
    Found,
    Planted,
    Record,
    append,
    read,
)
from benchmarks.hidden_effects_score import POOLED, Share, score, wilson
from benchmarks.hidden_effects_table import markdown, picture, told

GROUPS = Groups(
    same=0.9,
    pairs={
        frozenset(("cubic at tip", "cubic at mid")): 0.97,
        frozenset(("mass at tip", "density of all")): 0.85,
    },
)


def fitted(effect: str, strength: float = 1.0, deviation: float = 0.04, held_error: float = 0.012) -> Fitted:
    return Fitted(
        effect=effect, kind=effect.split(" at ")[0].split(" of ")[0], strength=strength, deviation=deviation,
        vanishes=0.0, gain=40.0, error=0.01, held_error=held_error, held_chi2=1.1,
    )  # fmt: skip


def record(row: str, seed: int, effect: str, finding: str, *named: Fitted, ranking: tuple[Fitted, ...] = ()) -> Record:
    kind = row.removesuffix("_excluded")
    return Record(
        row=row, seed=seed, planted=Planted(kind=kind, place="tip", effect=effect, value=1.0), finding=finding,
        named=named, ranking=ranking or named, held_error=0.02, floor=0.01, make_seconds=6.0, diagnose_seconds=10.0,
        place=Found(
            name="tip", gain=9.0, exponent=3.0, exponent_deviation=math.inf, phase=180.0, configuration="jointed"
        ),
    )  # fmt: skip


MASS, SPRING, CUBIC = "mass at tip", "spring at mid", "cubic at tip"
RECORDS = [
    record("mass", 1, MASS, MISSING, fitted(MASS, strength=1.1)),
    record("mass", 2, MASS, AMBIGUOUS, fitted("density of all"), fitted(MASS)),
    record("mass", 3, MASS, NONE, ranking=(fitted(MASS, strength=1.2),)),
    record("spring", 4, SPRING, MISSING, fitted("spring at tip")),
    record("spring", 5, SPRING, AMBIGUOUS, fitted("mass at tip"), fitted("mass at mid")),
    record("cubic", 6, CUBIC, MISSING, fitted("cubic at mid", held_error=0.018)),
    record("cubic", 7, CUBIC, FAILED),
    record("nothing", 8, "", NONE),
    record("nothing", 9, "", MISSING, fitted("dashpot at tip")),
    record("nothing", 10, "", UNKNOWN),
    record("cubic_excluded", 11, CUBIC, UNKNOWN),
    replace(record("stop", 12, "", UNKNOWN), place=None),
    record("stop", 13, "", NONE),
]


@pytest.mark.parametrize(
    ("count", "of", "low", "high"),
    # R. G. Newcombe, Two-sided confidence intervals for the single proportion, Statistics in Medicine 17 (1998)
    # 857-872, table I, method 3, given to four digits.
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0000, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_the_interval_is_that_of_the_published_table(count: int, of: int, low: float, high: float) -> None:
    assert wilson(count, of) == pytest.approx((low, high), abs=5e-5)


def test_the_interval_is_the_same_seen_from_either_side_and_knows_nothing_of_nothing() -> None:
    low, high = wilson(3, 20)
    assert wilson(17, 20) == pytest.approx((1 - high, 1 - low))
    assert wilson(0, 0) == (0.0, 1.0)
    assert wilson(20, 20)[1] == 1.0


def test_the_matrix_counts_every_campaign_once_and_knows_where_it_belongs() -> None:
    matrix = confusion(RECORDS, GROUPS)
    assert matrix.rows == ("mass", "spring", "cubic", "nothing", "cubic_excluded", "stop")
    assert matrix.count.sum(axis=1).tolist() == [3, 2, 2, 3, 1, 2]
    expected = {
        ("mass", "mass"): 1, ("mass", AMONG): 1, ("mass", "nothing"): 1, ("spring", ELSEWHERE): 1,
        ("spring", APART): 1, ("cubic", "cubic"): 1, ("cubic", "failed"): 1, ("nothing", "nothing"): 1,
        ("nothing", "dashpot"): 1, ("nothing", "none of the known"): 1, ("cubic_excluded", "none of the known"): 1,
        ("stop", "none of the known"): 1, ("stop", "nothing"): 1,
    }  # fmt: skip
    result = {(matrix.rows[i], matrix.columns[j]): int(n) for (i, j), n in np.ndenumerate(matrix.count) if n}
    assert result == expected
    assert int(matrix.count[matrix.right].sum()) == 6


def test_shares_count_what_they_say() -> None:
    scored = score(RECORDS, GROUPS)
    mass, spring, cubic, pooled = (scored.planted[row] for row in ("mass", "spring", "cubic", POOLED))
    # A cosine below the limit makes no group: the density that comes first is wrong.
    assert (mass.first, mass.itself) == (Share(count=2, of=3), Share(count=2, of=3))
    assert (mass.named, mass.wrong) == (Share(count=2, of=3), Share(count=0, of=3))
    assert (spring.first, spring.wrong) == (Share(count=0, of=2), Share(count=2, of=2))
    # Its group comes first; it has one, so that it is not asked to come first itself; what failed counts as wrong.
    assert (cubic.first, cubic.itself, cubic.named) == (
        Share(count=1, of=2),
        Share(count=0, of=0),
        Share(count=0, of=2),
    )
    assert (pooled.first, pooled.itself) == (Share(count=3, of=7), Share(count=2, of=5))
    assert scored.claims == Share(count=2, of=3)
    assert scored.excluded["cubic_excluded"].both == Share(count=1, of=1)
    stop = scored.excluded["stop"]
    assert (stop.unknown, stop.place, stop.both) == (Share(count=1, of=2), Share(count=1, of=2), Share(count=0, of=2))
    assert scored.failed == 1
    assert scored.seconds == (16.0, 16.0)


def test_strengths_are_judged_where_their_deviation_is_small() -> None:
    """1.1 with a deviation of 0.04 is within 15 %, but not within 1.96 deviations; 1.2 neither."""
    mass = score(RECORDS, GROUPS).planted["mass"]
    assert (mass.strength, mass.covered) == (Share(count=1, of=2), Share(count=0, of=2))
    rough = [replace(RECORDS[0], ranking=(fitted(MASS, strength=1.1, deviation=0.06),))]
    mass = score(rough, GROUPS).planted["mass"]
    assert (mass.strength, mass.covered) == (Share(count=0, of=0), Share(count=1, of=1))


def test_a_strength_counts_from_where_the_effect_vanishes() -> None:
    """A ratio of 1.08 instead of 1.1 is off by a fifth of what is missing."""
    ratio = replace(fitted("preload of left", strength=1.08, deviation=0.004), vanishes=1.0)
    line = record("preload", 1, "preload of left", MISSING, ratio)
    line = replace(line, planted=replace(line.planted, value=1.1))
    assert score([line], GROUPS).planted["preload"].strength == Share(count=0, of=1)
    near = replace(line, ranking=(replace(ratio, strength=1.09),))
    assert score([near], GROUPS).planted["preload"].strength == Share(count=1, of=1)


def test_the_excess_falls_by_what_is_named_alone() -> None:
    # Above a floor of 1 %: 2 to 1.2 %, 2 to 1.2 %, and nothing named.
    excess = score([record for record in RECORDS if record.row == "mass"], GROUPS).planted["mass"].excess
    assert (excess.of, excess.seen, excess.halved) == (3, 3, 2)
    assert excess.median == pytest.approx(0.2)
    assert excess.together == pytest.approx((0.2 + 0.2 + 1.0) / 3)


def test_the_excess_of_chi2_stands_above_campaigns_without_any_effect() -> None:
    mass = [record for record in RECORDS if record.row == "mass"]
    nothing = [replace(item, held_chi2=chi2) for item, chi2 in zip(
        [item for item in RECORDS if item.row == "nothing"][:1] * 2, (0.7, 0.9), strict=True)]  # fmt: skip
    named = [
        replace(item, held_chi2=1.2, named=tuple(replace(one, held_chi2=0.9) for one in item.named)) for item in mass
    ]
    # Above 0.8: 0.4 three times before; after, 0.1 where something is named, and 0.4 where nothing is.
    expected = sum(0.1 if item.named else 0.4 for item in named) / 1.2
    assert score([*named, *nothing], GROUPS).planted["mass"].excess.weighed == pytest.approx(expected)


def test_the_floor_is_where_campaigns_without_any_effect_are() -> None:
    nothing = [replace(item, held_error=0.011) for item in RECORDS if item.row == "nothing"]
    scored = score([*RECORDS[:3], *nothing], GROUPS)
    assert scored.floor_factor == pytest.approx(1.1)
    # 2 to 1.2 % above 1.1 %.
    assert scored.planted["mass"].excess.median == pytest.approx(0.1 / 0.9)


def test_a_record_survives_its_file_and_a_torn_line_does_not_spoil_the_next(tmp_path: Path) -> None:
    file = tmp_path / "records.jsonl"
    append(file, RECORDS[0])
    with file.open("ab") as stream:
        stream.write(RECORDS[1].line[:50].encode())
    append(file, RECORDS[2])
    again = replace(RECORDS[0], finding=NONE)
    append(file, again)
    assert [item.line for item in read(file)] == [again.line, RECORDS[2].line]
    assert read(file)[0].place is not None
    assert math.isnan(read(file)[0].threshold)


def test_groups_are_read_as_they_were_written(tmp_path: Path) -> None:
    def direction(name: str, *numbers: float) -> SimpleNamespace:
        return SimpleNamespace(effect=SimpleNamespace(name=name), direction=np.array(numbers))

    result = groups_of(
        [direction("a", 1, 0), direction("b", -0.96, 0.28), direction("c", 0.8, 0.6), direction("d", 0, 0)]  # type: ignore[list-item]
    )
    assert result.pairs == {frozenset("ab"): 0.96, frozenset("ac"): 0.8}
    assert result.of("a") == {"b"}
    assert (result.of("c"), result.unseen) == (frozenset(), ("d",))
    file = tmp_path / "groups.toml"
    file.write_text(result.toml, encoding="utf-8")
    assert read_groups(file) == result
    with pytest.raises(SystemExit, match=r"no_such\.toml: make it"):
        read_groups(tmp_path / "no_such.toml")


def test_every_part_of_the_plan_is_balanced_and_no_two_campaigns_share_a_seed() -> None:
    planned = cases(20, 100, 5000)
    assert len(planned) == len({case.seed for case in planned}) == 300
    assert len({case.seed // BETWEEN_ROWS for case in planned}) == len({case.row for case in planned}) == 11
    half = planned[:150]
    counts = {row: sum(case.row == row for case in half) for row in (*PLANTED, *EXCLUDED)}
    assert set(counts.values()) <= {9, 10, 11}
    assert {case.row for case in cases(2, 2, 0, ["gap"])} == {"gap"}
    with pytest.raises(SystemExit, match="1001 seeds a row"):
        cases(1001, 1, 0)


def test_tables_and_picture_tell_the_score() -> None:
    scored = score(RECORDS, GROUPS)
    text = markdown(scored)
    assert told(Share(count=81, of=263)) == "81 of 263, 31 % (26 to 37)"
    assert "| mass | 2 of 3, 67 % (21 to 94) |" in text
    assert "a claim in 2 of 3" in text
    assert "1 failed, and count as wrong" in text
    assert picture(scored.confusion).startswith(b"\x89PNG")
