"""Progress is quiet about what is quick, honest about time left, and out of the way of results."""

import io
from pathlib import Path

import pytest

from pipeline.duration import Durations, extrapolate, format_duration
from pipeline.progress import BarProgress, LineProgress, Progress, Report, ShownStep, SilentProgress
from pipeline.store import Store, stage


class Clock:
    """Time that passes when told to."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_a_quick_step_is_not_worth_a_line(clock: Clock) -> None:
    stream = io.StringIO()
    with LineProgress(stream, clock=clock).step("quick") as report:
        clock.now += 0.9
        report(1, 2)
    assert stream.getvalue() == ""


def test_time_left_is_the_time_so_far_over_the_part_done(clock: Clock) -> None:
    stream = io.StringIO()
    with LineProgress(stream, clock=clock).step("modes") as report:
        clock.now += 30
        report(1, 4)
        clock.now += 1
        report(2, 4)  # too soon for another line
        clock.now += 29
        report(3, 4)
    assert stream.getvalue().splitlines() == [
        "modes: 25 %, about 1 min 30 s left",
        "modes: 75 %, about 20 s left",
        "modes: done in 1 min 00 s",
    ]


def test_the_first_parts_of_a_step_tell_no_time_left(clock: Clock) -> None:
    # A first point that compiles for 20 s, of a thousand points of 20 ms, would promise five hours.
    stream = io.StringIO()
    with LineProgress(stream, clock=clock).step("limits") as report:
        clock.now += 20
        report(1, 1000)
        clock.now += 50
        report(10, 1000)
    assert stream.getvalue().splitlines()[:2] == ["limits: 0 %", "limits: 1 %, about 1 h 55 min left"]


def test_steps_of_another_case_say_nothing_of_this_one(tmp_path: Path) -> None:
    file = tmp_path / "durations.npz"
    for place, seconds in (("large", 400.0), ("small", 3.0)):
        Durations(file, place=place).remember("comparison", seconds)
    assert Durations(file, place="large").expected("comparison") == 400.0
    assert Durations(file, place="small").expected("comparison") == 3.0
    assert Durations(file, place="new").expected("comparison") is None


def test_a_step_that_reports_nothing_says_what_it_took_last_time(clock: Clock, tmp_path: Path) -> None:
    file = tmp_path / "durations.npz"
    for expected_lines in (["CAD: done in 20 s"], ["CAD ... about 20 s", "CAD: done in 20 s"]):
        stream = io.StringIO()
        with LineProgress(stream, Durations(file), clock).step("CAD"):
            clock.now += 20
        assert stream.getvalue().splitlines() == expected_lines


@stage("twice a number", ignore=("report",))
def twice(number: int, report: Report) -> int:
    report(1, 2)
    return 2 * number


def test_a_stage_that_is_kept_is_said_to_be_and_tells_no_former_time(clock: Clock, tmp_path: Path) -> None:
    stream, store = io.StringIO(), Store(tmp_path)
    progress = LineProgress(stream, clock=clock)
    for _ in range(2):
        step = ShownStep("doubling", store, progress, expected=20.0)

        def report(done: float, total: float, step: ShownStep = step) -> None:
            clock.now += 4
            step.report(done, total)

        assert step.run(twice, 3, report) == 6
    assert stream.getvalue().splitlines() == [
        "doubling ... about 20 s",
        "doubling: 50 %, about 4.0 s left",
        "doubling: done in 4.0 s",
        "doubling: stored",
    ]


def test_steps_within_steps_are_indented(clock: Clock) -> None:
    stream = io.StringIO()
    progress = LineProgress(stream, clock=clock)
    with progress.step("table"), progress.step("model"):
        clock.now += 2
    assert stream.getvalue().splitlines() == ["  model: done in 2.0 s", "table: done in 2.0 s"]


def test_a_step_that_fails_is_not_called_done(clock: Clock) -> None:
    stream = io.StringIO()

    def fail_after(seconds: float) -> None:
        clock.now += seconds
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"), LineProgress(stream, clock=clock).step("doomed"):
        fail_after(5)
    assert stream.getvalue() == ""


@pytest.mark.parametrize("content", ["", "{", "[1]", '{"a": "x"}', '"text"'])
def test_damaged_memories_of_durations_are_forgotten(tmp_path: Path, content: str) -> None:
    file = tmp_path / "durations.npz"
    file.write_text(content)
    told: list[str] = []
    durations = Durations(file, told.append)
    assert durations.expected("a") is None
    assert told == [f"{file} is damaged; its content will be computed again"]
    durations.remember("a", 3.0)
    assert Durations(file).expected("a") == 3.0


@pytest.mark.parametrize("progress", [SilentProgress(), BarProgress()])
def test_every_kind_lets_a_function_report_and_an_error_through(progress: Progress) -> None:
    with progress.step("outer") as outer, progress.step("inner", expected=3.0) as inner:
        inner(1, 2)
        outer(0.5, 1.0)
    with pytest.raises(KeyboardInterrupt), progress.step("doomed"):
        raise KeyboardInterrupt
    with progress.step("after") as report:
        report(1, 1)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.04, "0.0 s"), (9.94, "9.9 s"), (59.4, "59 s"), (59.6, "1 min 00 s"), (125, "2 min 05 s"), (3720, "1 h 02 min")],
)
def test_time_is_spoken_as_people_do(seconds: float, text: str) -> None:
    assert format_duration(seconds) == text


@pytest.mark.parametrize(
    ("share", "seconds", "left"), [(0.5, 10.0, 10.0), (0.01, 10.0, None), (0.01, 100.0, 9900.0), (0.0003, 100.0, None)]
)
def test_time_left_is_told_once_enough_is_done(share: float, seconds: float, left: float | None) -> None:
    assert extrapolate(share, 1.0, seconds) == (None if left is None else pytest.approx(left))
