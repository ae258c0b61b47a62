"""Repeats, levels and settling readings among the runs of a draft."""

from collections.abc import Sequence
from itertools import combinations, count
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.campaign.measurement import number_frequencies
from study.campaign.column_role import WORDS, Role, name_words
from study.campaign.draft import ManifestDraft, Run, without_marks
from study.campaign.draft_frequency import find_harmonic_of_rows, make_complex_force
from study.campaign.dwell import find_dwell_frequencies
from study.campaign.question import Marked
from study.campaign.run_name import find_last_number, repeat_in_name
from study.campaign.set_point import HELD
from study.campaign.table import MeasuredTable, make_file_stem
from study.campaign.time_history import estimate_sine_amplitude

Series = Float[NDArray[np.float64], " n"]

#: Significant digits of a measured level.
DIGITS = 2
#: Smallest excess of the steps in one direction, as a fraction of all steps, in a run of passes in one direction [-].
ONE_WAY = 0.5
#: Smallest number of readings at one frequency for a trend, and smallest fraction of frequencies that show it [-].
FEWEST, SHARE = 3, 0.7

REPEATS, SETTLING = "repeats", "settling"


def number_repeats(draft: ManifestDraft) -> None:
    """Give runs of one test at one set point a common level, and number those that measure the same points as repeats.

    Parameters
    ----------
    draft
        Draft; its runs are changed in place.
    """
    by_test: dict[tuple[str, bool], list[Run]] = {}
    for run in draft.entries["run"]:
        stated = "levels" in run or run["columns"].keys() & {"level", "repeat"}
        if not stated and isinstance(run, Run):
            by_test.setdefault((run["test"], "frequency" in run["columns"]), []).append(run)
    for (test, is_stepped), runs in by_test.items():
        levels = np.array([find_run_level(run) for run in runs])
        points = [find_run_direction(run) for run in runs] if is_stepped else _number_dwells(runs)
        alike: list[list[tuple[Run, int]]] = []
        for group in group_levels(levels, np.array(["level" in run for run in runs])):
            _give_one_level([runs[number] for number in group], levels[group])
            sensors: dict[tuple[str, ...], list[tuple[Run, int]]] = {}
            for number in group:
                run = runs[number]
                harmonic = find_harmonic_of_rows(run.judged, run.get("rows", {}))
                sensors.setdefault((str(harmonic), *sorted(run["columns"])), []).append((run, points[number]))
            alike += sensors.values()
        numbers, evidence = _repeat_numbers(alike)
        called = f"runs of {test} at one level and {'in one direction' if is_stepped else 'at one frequency'}"
        for repeats, of_each in zip(alike, numbers, strict=True):
            _number(draft, [run for run, _ in repeats], of_each, called, evidence)


def _number_dwells(runs: Sequence[Run]) -> list[int]:
    """Number of the frequency of each steady state, counted from 1."""
    frequencies = np.array(find_dwell_frequencies([run.judged for run in runs]))
    return [1 + int(number) for number in number_frequencies(frequencies)]


def group_levels(level: Series, stated: Bool[NDArray[np.bool_], " n"]) -> list[list[int]]:
    """Group runs by set point; the result has the indices of the runs of each group.

    Runs with a measured force within `HELD` of a stated level belong to it. Other runs are of one set point if
    successive forces differ by less than `HELD`, and the largest from the smallest by less than 2 `HELD`.

    Parameters
    ----------
    level
        Level of each run, as stated or as the median of its measured force, shape (n,); NaN without either.
    stated
        Whether the level is stated, shape (n,).
    """
    points = np.unique(level[stated])
    groups: list[list[int]] = [np.flatnonzero(stated & (level == point)).tolist() for point in points]
    chain: list[int] = []
    for number in np.flatnonzero(~stated)[np.argsort(level[~stated], kind="stable")].tolist():
        nearest = int(np.argmin(np.abs(points - level[number]))) if len(points) else -1
        if nearest >= 0 and abs(level[number] - points[nearest]) < HELD * points[nearest]:
            groups[nearest].append(number)
        elif chain and level[number] < min((1 + HELD) * level[chain[-1]], (1 + 2 * HELD) * level[chain[0]]):
            chain.append(number)
        else:
            chain = [number]
            groups.append(chain)
    return [sorted(group) for group in groups]


def _give_one_level(runs: Sequence[dict[str, Any]], levels: Series) -> None:
    """Write a common level into runs of one set point, if their measured forces differ."""
    if len(runs) < 2 or levels.max() == levels.min():
        return
    stated = next((run["level"] for run in runs if "level" in run), None)
    common = float(f"{np.median(levels):.{DIGITS}g}") if stated is None else without_marks(stated)
    why = f"forces from {levels.min():.4g} to {levels.max():.4g} are taken as one set point"
    for run in runs:
        if "level" not in run:
            columns = run.pop("columns")
            run["level"] = Marked(value=common, assumed=why)
            run["columns"] = columns


def _repeat_numbers(groups: Sequence[Sequence[tuple[Run, int]]]) -> tuple[list[list[int]], str]:
    """Repeat numbers of the runs of each group, and their source in words; empty if no attribute or name states them.

    Without a statement they are the last numbers in the names of files or groups, if these count from 1, each occurs
    once at a point, and at least one group has all of them. Otherwise the runs are counted.
    """
    stated = [[_find_stated_repeat(run.judged.table) for run, _ in group] for group in groups]
    if all(number for numbers in stated for number, _ in numbers):
        named = [[number for number, _ in numbers] for numbers in stated]
        if all(_is_apart(group, numbers) for group, numbers in zip(groups, named, strict=True)):
            return named, stated[0][0][1]
    named = [[find_last_number(_run_name(run.judged.table)) for run, _ in group] for group in groups]
    whole = set(range(1, 1 + len({number for numbers in named for number in numbers})))
    are_repeats = all(
        _is_apart(group, numbers) and {*numbers} <= whole for group, numbers in zip(groups, named, strict=True)
    )
    if are_repeats and any({*numbers} == whole for numbers in named):
        return named, ""
    return [_count_repeats(group) for group in groups], ""


def _find_stated_repeat(table: MeasuredTable) -> tuple[int, str]:
    """Number of the repeat stated by an attribute or a word of the name, and its source; 0 without one."""
    for name, number in table.scalars.items():
        if set(name_words(name)) & WORDS[Role.REPEAT] and number > 0 and number == int(number):
            return int(number), f'the scalar "{name}" of its file'
    return repeat_in_name(_run_name(table)) or 0, "the repeat in its name"


def _run_name(table: MeasuredTable) -> str:
    return f"{make_file_stem(table.file.path.name)} {table.path} {table.of_set}".rstrip()


def _share_points(one: int, other: int) -> bool:
    """Whether two runs measure the same points, by their directions or frequency numbers; 0 is both directions."""
    return one == other or 0 in {one, other}


def _is_apart(group: Sequence[tuple[Run, int]], numbers: Sequence[int]) -> bool:
    """Whether no two runs with the same points have the same number."""
    pairs = combinations(zip(group, numbers, strict=True), 2)
    return not any(a == b and _share_points(one, other) for ((_, one), a), ((_, other), b) in pairs)


def _count_repeats(group: Sequence[tuple[Run, int]]) -> list[int]:
    """Number runs: each gets the first number that no earlier run with the same points has."""
    numbers: list[int] = []
    for place, (_, own) in enumerate(group):
        taken = {number for number, (_, other) in zip(numbers, group[:place], strict=True) if _share_points(own, other)}
        numbers.append(next(number for number in count(1) if number not in taken))
    return numbers


def _number(draft: ManifestDraft, runs: Sequence[Run], numbers: Sequence[int], called: str, evidence: str) -> None:
    """Write the repeat numbers of runs of one level; mark their test if the runs are one response that settles."""
    if {*numbers} == {1}:
        return
    why = evidence or f"{called} are taken as repeats"
    settle = Marked(value=REPEATS, assumed=why) if evidence else _ask(draft, f"Are {called} repeats", REPEATS, why)
    entry = draft.named("test", runs[0]["test"])
    if settle.value == SETTLING and entry is not None:
        entry["settling"] = Marked(value=True, assumed=settle.assumed)
    for number, run in zip(numbers, runs, strict=True):
        columns = run.pop("columns")
        run["repeat"] = Marked(value=number, assumed=why if settle.assumed else "")
        run["columns"] = columns


def mark_settling(draft: ManifestDraft, test: str, frequency: Series, sizes: Sequence[Series]) -> None:
    """Ask whether successive readings at one frequency settle, and mark their test if they do.

    Parameters
    ----------
    draft
        Draft with the test.
    test
        Name of the test.
    frequency, sizes
        Frequencies in the order of measurement, shape (n,), and moduli of each response there, shape (n,) each.
    """
    entry = draft.named("test", test)
    if entry is None or len(_find_blocks(frequency)) < FEWEST:
        return
    evidence = is_settling(frequency, sizes)
    why = evidence or "successive readings at one frequency show no trend"
    text = f"Are successive readings of {test} at one frequency repeats"
    answer = _ask(draft, text, SETTLING if evidence else REPEATS, why)
    if answer.value == SETTLING:
        entry["settling"] = Marked(value=True, assumed=answer.assumed)


def _ask(draft: ManifestDraft, text: str, default: str, why: str) -> Marked:
    """Ask whether readings are repeats or one response that settles."""
    return draft.ask(f"{text}, or one response that is still settling?", default, why, REPEATS, SETTLING)


def find_run_level(run: Run) -> float:
    """Level of a run: as stated, or the median or the amplitude of the measured force; NaN without either."""
    if "level" in run:
        return float(without_marks(run["level"]))
    force = make_complex_force(run.judged)
    if force is None:
        return float("nan")
    force = force[run.judged.mask(run.get("rows", {}))]
    return float(np.nanmedian(np.abs(force))) if "frequency" in run["columns"] else estimate_sine_amplitude(force.real)


def find_run_direction(run: Run) -> int:
    """Direction of a run: +1 for rising frequency, -1 for falling frequency, 0 for both or neither.

    A file of several passes in one direction has one step back per pass, so that the majority of the steps decides.
    """
    if "sweep" in run:
        return {"up": 1, "down": -1}.get(str(without_marks(run["sweep"])), 0)
    frequency = run.judged.of_role(Role.FREQUENCY)[0].values[run.judged.mask(run.get("rows", {}))]
    steps = np.sign(np.diff(frequency.real))
    turned = float(steps.sum()) / max(int(np.count_nonzero(steps)), 1)
    return int(np.sign(turned)) if abs(turned) > ONE_WAY else 0


def is_settling(
    frequency: Float[NDArray[np.float64], " n"], response: Sequence[Float[NDArray[np.float64], " n"]]
) -> str:
    """Evidence that successive readings at one frequency are one response that settles, not repeats.

    Parameters
    ----------
    frequency
        Frequencies in the order of measurement, shape (n,).
    response
        Moduli of the responses of each sensor, shape (n,) each.

    Returns
    -------
    Evidence in words; empty if they do not settle, or there are too few readings.
    """
    blocks = _find_blocks(frequency)
    if len(blocks) < FEWEST:
        return ""
    settling = sum(any(_settles(values[start:end]) for values in response) for start, end in blocks)
    if settling < SHARE * len(blocks):
        return ""
    return f"successive readings approach a limit in ever smaller steps at {settling} of {len(blocks)} frequencies"


def _find_blocks(frequency: Series) -> list[tuple[int, int]]:
    """Start and end (exclusive) of each block of at least `FEWEST` successive readings at one frequency."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(frequency) != 0])).tolist()
    return [
        (start, end) for start, end in zip(starts, [*starts[1:], len(frequency)], strict=True) if end - start >= FEWEST
    ]


def _settles(values: Series) -> bool:
    steps = np.diff(values)
    one_way = bool((steps > 0).all() or (steps < 0).all())
    return one_way and bool(abs(steps[-1]) < 0.7 * abs(steps[0]))
