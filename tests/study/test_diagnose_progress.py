"""Time left of a diagnosis is that of what is still to be made; what is kept is called so."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from diagnosis.diagnose import LONG_PROGRESS, USUAL_PROGRESS
from pipeline.progress import LineProgress
from pipeline.store import Store
from study.diagnose.progress import phases
from study.diagnose.round import step

PARTS = ("screening", "fits", "tests", "explanation", "intervals")


class Clock:
    """Time that passes when told to."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def shown(known: dict[str, float], found: set[str]) -> list[str]:
    """Lines of a round whose steps take so long [s], some of them kept; each is a fifth of it."""
    clock, stream = Clock(), io.StringIO()

    def run_step(name: str, make: Callable[[], Any]) -> Any:
        return None if name in found else make()

    with phases(LineProgress(stream, clock=clock), found.__contains__) as of:
        look = of.watched(run_step)
        for number, (name, seconds) in enumerate(known.items()):
            of.report(name, number / len(known))

            def make(seconds: float = seconds) -> None:
                clock.now += seconds

            look(name, make)
        of.report("done", 1.0)
    return stream.getvalue().splitlines()


STEPS = {"arrangement": 20.0, "scores": 20.0, "fits": 20.0, "left": 20.0, "nominal": 20.0}


def test_a_round_of_which_nothing_is_kept_counts_all_of_it() -> None:
    lines = shown(STEPS, set())
    assert lines[0] == "diagnosis ... about 1 min 30 s"
    assert "diagnosis: 20 %, about 1 min 20 s left" in lines
    assert "diagnosis: 80 %, about 20 s left" in lines
    assert not any("stored" in line for line in lines)


def test_what_is_kept_is_called_so_and_does_not_shorten_the_time_left() -> None:
    lines = shown(STEPS, {"arrangement", "scores"})
    # Not what a whole round takes: that is not what is ahead.
    assert lines[:2] == ["  arrangement: stored", "  scores: stored"]
    # Three steps of five are left; after one of them two remain, 40 s.
    assert "diagnosis, from the fits on: 33 %, about 40 s left" in lines
    assert "  fits: done in 20 s" in lines


def test_a_phase_in_which_the_user_interrupts_is_not_done() -> None:
    clock, stream = Clock(), io.StringIO()

    def interrupted() -> None:
        clock.now += 20.0
        raise KeyboardInterrupt

    def calibrate() -> None:
        with phases(LineProgress(stream, clock=clock), lambda _: False) as of:
            of.report("calibration", 0.0)
            of.watched(lambda _, make: make())("arrangement", interrupted)

    with pytest.raises(KeyboardInterrupt):
        calibrate()
    assert "calibration: done" not in stream.getvalue()


def test_a_round_that_is_kept_as_a_whole_takes_no_time() -> None:
    lines = shown(STEPS, set(STEPS))
    assert lines == [f"  {name}: stored" for name in STEPS]


def test_a_step_whose_kept_result_is_damaged_is_one_that_is_to_be_made(tmp_path: Path) -> None:
    told: list[str] = []
    store, clock, stream = Store(tmp_path, told.append), Clock(), io.StringIO()
    for name in STEPS:
        store.run(step, "key", name, dict)
    (file,) = tmp_path.rglob(f"{step.key('key', 'scores', dict)}.npz")
    file.write_bytes(b"")

    def slowly() -> dict[str, float]:
        clock.now += 20.0
        return {}

    with phases(LineProgress(stream, clock=clock), lambda name: store.has(step, "key", name, dict)) as of:
        look = of.watched(lambda name, make: store.run(step, "key", name, make))
        for name in STEPS:
            of.report(name, 0.5)
            look(name, slowly)
    (sentence,) = told
    assert sentence.startswith("a stored result is damaged and will be computed again: step of a diagnosis in ")
    lines = stream.getvalue().splitlines()
    assert [line for line in lines if "stored" in line] == [f"  {name}: stored" for name in STEPS if name != "scores"]
    assert {"  scores: done in 20 s", "diagnosis, from the screening on: done in 20 s"} <= set(lines)


def test_shares_of_a_round_rise() -> None:
    for progress in (USUAL_PROGRESS, LONG_PROGRESS):
        values = [getattr(progress, part) for part in PARTS]
        assert values == sorted(values)
        assert 0 < values[0] < values[-1] < 1
        assert progress.between("fits", "tests", 0.5) == (progress.fits + progress.tests) / 2
