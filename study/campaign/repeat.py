"""Repeats, levels and settling readings among the runs of a draft."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from correlation.file.column import MeasuredFile
from study.campaign.draft import Draft, plain
from study.campaign.level import LEVEL_IN_NAME
from study.campaign.question import Marked
from study.campaign.set_point import HELD
from study.campaign.table import file_stem

Series = Float[NDArray[np.float64], " n"]

#: Digits of a level that was measured.
DIGITS = 2
#: Share by which steps one way exceed those the other way in passes of one direction [-].
ONE_WAY = 0.5
#: Readings at one frequency from which a trend can be told, and the share of frequencies that must show it [-].
FEWEST, SHARE = 3, 0.7

REPEATS, SETTLING = "repeats", "settling"


def number_repeats(draft: Draft, files: Mapping[str, MeasuredFile]) -> None:
    """Give runs of one test at one set point one level, and those of one direction of sweep among them a number each.

    Parameters
    ----------
    draft
        Draft whose runs change.
    files
        Measured files by their names.
    """
    by_test: dict[str, list[dict[str, Any]]] = {}
    for run in draft.entries["run"]:
        stated = "levels" in run or run["columns"].keys() & {"level", "repeat"}
        if not stated and "frequency" in run["columns"]:
            by_test.setdefault(run["test"], []).append(run)
    for test, runs in by_test.items():
        levels = np.array([run_level(run, files) for run in runs])
        alike: list[list[dict[str, Any]]] = []
        for group in group_levels(levels, np.array(["level" in run for run in runs])):
            members = [runs[number] for number in group]
            _give_one_level(members, levels[group])
            kinds: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
            for run in members:
                kinds.setdefault((run_direction(run, files), *sorted(run["columns"])), []).append(run)
            alike += kinds.values()
        for repeats, numbers in zip(alike, _repeat_numbers(alike), strict=True):
            _number(draft, test, repeats, numbers)


def group_levels(level: Series, stated: Bool[NDArray[np.bool_], " n"]) -> list[list[int]]:
    """Numbers of the runs of each set point.

    Forces near a stated level are of it. Others are of one set point if neighbours are less apart than what a control
    misses it by, and all of them less than what two runs on either side of it may be.

    Parameters
    ----------
    level
        Level of each run, as stated or as the median of its measured force, shape (n,); NaN without either.
    stated
        Whether it is stated, shape (n,).
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
    """Write the level of runs that have one set point, if their measured forces differ."""
    if len(runs) < 2 or levels.max() == levels.min():
        return
    stated = next((run["level"] for run in runs if "level" in run), None)
    common = float(f"{np.median(levels):.{DIGITS}g}") if stated is None else plain(stated)
    why = f"forces from {levels.min():.4g} to {levels.max():.4g} are taken for one set point"
    for run in runs:
        if "level" not in run:
            columns = run.pop("columns")
            run["level"] = Marked(value=common, assumed=why)
            run["columns"] = columns


def _repeat_numbers(groups: Sequence[Sequence[Mapping[str, Any]]]) -> list[list[int]]:
    """Numbers of the runs of each group: those that end the names of their files, or else their places in the group.

    Names number repeats if they count from 1 on, each once in a group, and a group has them all; others may lack some.
    """
    named = [[_last_number(str(run["file"])) for run in group] for group in groups]
    whole = set(range(1, 1 + len({number for numbers in named for number in numbers})))
    counted = [list(range(1, 1 + len(group))) for group in groups]
    are_repeats = all(len({*numbers}) == len(numbers) and {*numbers} <= whole for numbers in named)
    return named if are_repeats and any({*numbers} == whole for numbers in named) else counted


def _last_number(file: str) -> int:
    """The last number in the name of a file that is no level; 0 if there is none."""
    numbers = re.findall(r"\d+", LEVEL_IN_NAME.sub("", file_stem(file)))
    return int(numbers[-1]) if numbers else 0


def _number(draft: Draft, test: str, runs: Sequence[dict[str, Any]], numbers: Sequence[int]) -> None:
    """Number runs of one level and direction, unless they are one response that settles."""
    if len(runs) < 2 and 1 in numbers:
        return
    why = f"runs of {test} at one level and in one direction are taken for repeats"
    settle = _ask(draft, f"Are runs of {test} at one level and of one direction repeats", REPEATS, why)
    entry = draft.named("test", test)
    if settle.value == SETTLING and entry is not None:
        entry["settling"] = Marked(value=True, assumed=settle.assumed)
    for number, run in zip(numbers, runs, strict=True):
        columns = run.pop("columns")
        run["repeat"] = Marked(value=number, assumed=why if settle.assumed else "")
        run["columns"] = columns


def mark_settling(draft: Draft, test: str, frequency: Series, sizes: Sequence[Series]) -> None:
    """Ask whether readings that follow each other at one frequency settle, and say so in their test.

    Parameters
    ----------
    draft
        Draft with the test.
    test
        Its name.
    frequency, sizes
        Frequencies in the order of measurement, shape (n,), and the sizes of each response there, shape (n,) each.
    """
    entry = draft.named("test", test)
    if entry is None or len(_blocks(frequency)) < FEWEST:
        return
    evidence = is_settling(frequency, sizes)
    why = evidence or "readings at one frequency go in no one direction"
    text = f"Are readings of {test} that follow each other at one frequency repeats"
    answer = _ask(draft, text, SETTLING if evidence else REPEATS, why)
    if answer.value == SETTLING:
        entry["settling"] = Marked(value=True, assumed=answer.assumed)


def _ask(draft: Draft, text: str, default: str, why: str) -> Marked:
    """Whether readings are repeats or one response that settles."""
    return draft.ask(f"{text}, or one response that settles?", default, why, REPEATS, SETTLING)


def run_level(run: Mapping[str, Any], files: Mapping[str, MeasuredFile]) -> float:
    """Level of a run: its number, or the median of the measured force; NaN without either."""
    if "level" in run:
        return float(plain(run["level"]))
    force = run["columns"].get("force")
    if force is None:
        return float("nan")
    entry = {"column": force} if isinstance(force, str) else plain(force)
    values = _column(run, files, str(next(iter(entry.values()))))
    return float(np.nanmedian(np.abs(values)))


def run_direction(run: Mapping[str, Any], files: Mapping[str, MeasuredFile]) -> int:
    """+1 for a run whose frequency rises, -1 for one where it falls, 0 for both or neither.

    A file of several passes goes back once for each, so that most of its steps tell.
    """
    entry = run["columns"]["frequency"]
    values = _column(run, files, str(entry if isinstance(entry, str) else plain(entry)["column"]))
    steps = np.sign(np.diff(values.real))
    turned = float(steps.sum()) / max(int(np.count_nonzero(steps)), 1)
    return int(np.sign(turned)) if abs(turned) > ONE_WAY else 0


def _column(run: Mapping[str, Any], files: Mapping[str, MeasuredFile], name: str) -> NDArray[Any]:
    return files[run["file"]].column(name).values


def is_settling(
    frequency: Float[NDArray[np.float64], " n"], response: Sequence[Float[NDArray[np.float64], " n"]]
) -> str:
    """Whether readings that follow each other at one frequency are one response that settles, not repeats.

    Parameters
    ----------
    frequency
        Frequencies in the order of measurement, shape (n,).
    response
        Sizes of the responses of each sensor, shape (n,) each.

    Returns
    -------
    The evidence; empty if they are not, or if there are too few readings to tell.
    """
    blocks = _blocks(frequency)
    if len(blocks) < FEWEST:
        return ""
    settling = sum(any(_settles(values[start:end]) for values in response) for start, end in blocks)
    if settling < SHARE * len(blocks):
        return ""
    return f"readings at one frequency go one way in ever smaller steps at {settling} of {len(blocks)} frequencies"


def _blocks(frequency: Series) -> list[tuple[int, int]]:
    """First and last reading, exclusive, of each frequency at which readings follow each other."""
    starts = np.flatnonzero(np.concatenate([[True], np.diff(frequency) != 0])).tolist()
    return [
        (start, end) for start, end in zip(starts, [*starts[1:], len(frequency)], strict=True) if end - start >= FEWEST
    ]


def _settles(values: Series) -> bool:
    steps = np.diff(values)
    one_way = bool((steps > 0).all() or (steps < 0).all())
    return one_way and bool(abs(steps[-1]) < 0.7 * abs(steps[0]))
