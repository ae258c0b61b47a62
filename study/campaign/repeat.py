"""Repeats, levels and settling readings among the runs of a draft."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.file.column import MeasuredFile
from study.campaign.draft import Draft, plain
from study.campaign.question import Marked

Series = Float[NDArray[np.float64], " n"]

#: Runs whose levels differ by less are repeats of one level [-].
SAME_LEVEL = 0.03
#: Digits of a level that was measured.
DIGITS = 2
#: Share by which steps one way exceed those the other way in passes of one direction [-].
ONE_WAY = 0.5
#: Readings at one frequency from which a trend can be told, and the share of frequencies that must show it [-].
FEWEST, SHARE = 3, 0.7

REPEATS, SETTLING = "repeats", "settling"


def number_repeats(draft: Draft, files: Mapping[str, MeasuredFile]) -> None:
    """Give runs of one test, level and direction of sweep one level and a number each.

    Parameters
    ----------
    draft
        Draft whose runs change.
    files
        Measured files by their names.
    """
    groups: list[tuple[tuple[Any, ...], float, list[dict[str, Any]]]] = []
    for run in draft.entries["run"]:
        stated = "levels" in run or run["columns"].keys() & {"level", "repeat"}
        if stated or "frequency" not in run["columns"]:
            continue
        level = run_level(run, files)
        kind = (run["test"], run_direction(run, files), *sorted(run["columns"]))
        for other, first, members in groups:
            if kind == other and abs(level / first - 1) < SAME_LEVEL:
                members.append(run)
                break
        else:
            groups.append((kind, level, [run]))
    for (test, *_), _, members in groups:
        if len(members) < 2:
            continue
        levels = [run_level(run, files) for run in members]
        why = f"runs of {test} at one level and in one direction are taken for repeats"
        differ = f"the levels of repeats, from {min(levels):.4g} to {max(levels):.4g}, are taken for one"
        settle = _ask(draft, f"Are runs of {test} at one level and of one direction repeats", REPEATS, why)
        why, differ = (why, differ) if settle.assumed else ("", "")
        entry = draft.named("test", test)
        if settle.value == SETTLING and entry is not None:
            entry["settling"] = Marked(value=True, assumed=settle.assumed)
        common = float(f"{np.median(levels):.{DIGITS}g}")
        for number, run in enumerate(members, start=1):
            columns = run.pop("columns")
            if max(levels) > min(levels):
                run["level"] = Marked(value=common, assumed=differ)
            run["repeat"] = Marked(value=number, assumed=why)
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
    return float(np.median(np.abs(values)))


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
