"""The calls of the bench on two masses: the same numbers once more, nothing written over what others wrote."""

import errno
import json
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geometry.errors import InputError
from pipeline.store import Store
from study.bench.bench import Bench
from study.bench.case_text import hash_text
from study.bench.copied_case import copy_beside
from study.bench.repeat import open_bench
from study.bench.script import ScriptEntry, format_script
from study.diagnose.history import history_of, read_text
from study.json_value import to_json
from study.run_context import RunContext, silent_run
from tests.study.conftest import TwoMasses

HIDDEN = {"mass at tip": 0.006}


@pytest.fixture
def cache(kept_rounds: Store) -> Path:
    """What one test has computed of the two masses serves the others: they are the same."""
    assert kept_rounds.folder is not None
    return kept_rounds.folder


@pytest.fixture
def make_bench(two_masses: TwoMasses, cache: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], Bench]:
    """Makes the bench of the two masses."""
    case = two_masses(HIDDEN)
    monkeypatch.setenv("STICKSLIP_CACHE", str(cache))

    def make() -> Bench:
        store = Store(cache)
        run = RunContext(output=None, store=store, progress=silent_run().progress, json=False, quiet=True)
        return Bench(case, Path("campaign").resolve(), run)

    return make


def test_an_effect_is_added_and_the_script_of_all_clicks_gives_the_same_numbers(
    make_bench: Callable[[], Bench], capsys: pytest.CaptureFixture[str]
) -> None:
    bench, entries = make_bench(), []
    drawn = read_text(bench.case)

    def done(name: str, **arguments: Any) -> Any:
        result = getattr(bench, name)(**arguments)
        entries.append(ScriptEntry(name=name, arguments=arguments, numbers=result.numbers))
        return result

    before = done("compare")
    screened = done("screen")
    assert screened.views["candidates"]["rows"][0]["name"] == "mass at tip"
    assert done("diagnose").numbers["finding"] == "missing"
    added = done("add", effect="mass at tip", seen=hash_text(drawn))
    # Noise of 0.2 % is left of an error that a resonance a quarter of a per cent off makes.
    assert added.numbers["held-out error after [%]"] < 0.05 * added.numbers["held-out error before [%]"]
    after = done("compare")
    assert after.numbers["training deviations [-]"] < 1.5 < 10 < before.numbers["training deviations [-]"]
    assert [row["name"] for row in after.views["parameters"] if row["is_effect"]] == ["mass at tip"]
    done("move", values={"mass at tip": 0.007})
    done("edit", text=read_text(bench.case) + "# mine\n")
    done("undo")
    assert read_text(bench.case) == drawn + "# mine\n"

    # Run in this process, whose imports are there; the story in the browser runs one as a user does.
    script = format_script(entries, bench.case, bench.folder, (), drawn, "")
    exec(compile(script, "again.py", "exec"), {"__name__": "__main__"})
    printed = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert printed == [to_json(entry.numbers) for entry in entries]
    assert read_text(bench.case) == drawn + "# mine\n"
    assert list(Path().glob(".chain-*")) == []


def test_a_calibration_is_written_and_taken_back(make_bench: Callable[[], Bench]) -> None:
    bench = make_bench()
    drawn = read_text(bench.case)
    result = bench.calibrate(seen=hash_text(drawn))
    assert "[calibrated]" in read_text(bench.case)
    assert result.numbers["training error after [%]"] < result.numbers["training error before [%]"]
    assert [step["back"] for step in result.views["history"]] == [1]
    bench.undo()
    assert read_text(bench.case) == drawn
    assert [step.what for step in history_of(bench.case).steps] == ["calibration", "undo"]


def test_a_case_that_is_another_one_than_was_seen_is_not_written(make_bench: Callable[[], Bench]) -> None:
    bench = make_bench()
    seen = hash_text(read_text(bench.case))
    bench.edit(read_text(bench.case) + "# by hand\n")
    text = read_text(bench.case)
    for click in (
        lambda: bench.add("mass at tip", ["6 g"], seen=seen),
        lambda: bench.undo(seen=seen),
        lambda: bench.calibrate(seen=seen),
    ):
        with pytest.raises(InputError, match=bench.case.name):
            click()
    assert read_text(bench.case) == text
    assert history_of(bench.case).steps == ()


def test_two_benches_on_one_case_do_not_write_over_each_other(make_bench: Callable[[], Bench]) -> None:
    one, other = make_bench(), make_bench()
    seen = hash_text(read_text(one.case))
    one.add("mass at tip", ["6 g"], seen=seen)
    with pytest.raises(InputError):
        other.add("mass at base", ["1 g"], seen=seen)
    other.add("mass at base", ["1 g"], seen=hash_text(read_text(other.case)))
    assert [step.effect for step in history_of(one.case).active_steps] == ["mass at tip", "mass at base"]
    one.undo(2)
    assert history_of(one.case).active_steps == ()


def test_a_full_disk_is_a_sentence_and_leaves_the_case_as_it_is(
    make_bench: Callable[[], Bench], monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = make_bench()
    drawn = read_text(bench.case)

    def full(file: Path, _content: bytes) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(file))

    monkeypatch.setattr("study.diagnose.history.replace_file", full)
    with pytest.raises(InputError, match=os.strerror(errno.ENOSPC)):
        bench.add("mass at tip", ["6 g"])
    assert read_text(bench.case) == drawn


def test_slopes_of_the_lines_are_those_of_exact_lines(make_bench: Callable[[], Bench]) -> None:
    bench = make_bench()
    shown = bench.compare().views["responses"]["panels"]
    names = [row["name"] for row in bench.compare().views["parameters"]]
    step = 1e-3
    for number, name in enumerate(names):
        high, low = (bench.move({name: 1 + side * step}).views["moved"]["panels"] for side in (1, -1))
        for panel, above, below in zip(shown, high, low, strict=True):
            if panel["harmonic"] != 1:
                continue  # a structure without joints has none
            for group, one, other in zip(panel["groups"], above, below, strict=True):
                value, slope, up, down = (
                    np.array(item, dtype=float).T @ [1, 1j]
                    for item in (group["value"], group["slopes"][number], one, other)
                )
                # F / X is nearly linear in the parameters where X is not. Lines hold six digits: of a difference by
                # a thousandth of a parameter, which moves F / X by as much of its parts, a hundredth is sure.
                change, expected = 1 / up - 1 / down, -2 * step * slope / value**2
                np.testing.assert_allclose(change, expected, rtol=0.01, atol=2e-5 * np.abs(1 / value).max())


def test_the_python_of_the_page_finds_adds_and_takes_back(
    make_bench: Callable[[], Bench], capsys: pytest.CaptureFixture[str]
) -> None:
    bench = make_bench()
    drawn = read_text(bench.case)
    page = (Path(__file__).parents[3] / "docs" / "bench.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^```python\n(.*?)```", page, re.MULTILINE | re.DOTALL)
    exec(compile(block.replace("beam.toml", bench.case.name), "docs/bench.md", "exec"), {})
    assert capsys.readouterr().out.count("training deviations") == 2
    assert [step.what for step in history_of(bench.case).steps] == ["diagnosis", "add", "undo"]
    assert read_text(bench.case) == drawn


def test_a_parameter_at_its_bound_comes_first(make_bench: Callable[[], Bench]) -> None:
    bench = make_bench()
    names = [row["name"] for row in bench.compare().views["parameters"]]
    bench.edit(read_text(bench.case) + f"[calibrated]\n{names[-1]} = 0.95\n")
    rows = bench.compare().views["parameters"]
    # Young's modulus is known to 1 %, and no fit goes further than five times that.
    assert names[-1] == "E"
    assert [(row["name"], row["at_bound"]) for row in rows] == [("E", True), *((name, False) for name in names[:-1])]
    assert rows[0]["slider"]["first"] == pytest.approx(0.95)


def test_an_unknown_parameter_is_refused_with_those_that_there_are(make_bench: Callable[[], Bench]) -> None:
    with pytest.raises(InputError, match="zeta"):
        make_bench().move({"zetta": 1.1})


def test_a_copy_beside_the_case_is_removed_even_after_a_failure(make_bench: Callable[[], Bench]) -> None:
    bench = make_bench()
    before = sorted(Path().iterdir())

    def fail() -> None:
        with copy_beside(bench.case, read_text(bench.case), "") as copy:
            open_bench(copy, bench.folder, cache=Path("cache")).add("mass at tip", ["6 g"])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert sorted(Path().iterdir()) == sorted([*before, Path("cache")] if Path("cache") not in before else before)
