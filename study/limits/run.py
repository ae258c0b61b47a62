"""``stickslip limits``: the band of responses that unknown friction history can produce, of a rig or a structure."""

import tempfile
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from figure.contact_states import ContactStates, StatePanel
from figure.limit_band import Band, LimitBands
from figure.limit_levels import LimitsByLevel
from hbsolve.limits.result import ResponseLimits
from hbsolve.matlab import make_matlab_file
from pipeline.checkpoint import StoredTasks
from pipeline.output import replace_file
from pipeline.parallel import process_pool
from study.case.setup import read_case
from study.kind.registry import open_case
from study.limits.curve import FoundLimits, found_limits
from study.limits.grid import find_narrow_resonance
from study.limits.model import LimitSearch, list_limit_points, make_limit_search
from study.limits.result import SIDES, LimitCurves, convert_limits, format_limits_csv
from study.limits.table import FORCES
from study.run_context import RunContext
from study.solve.model import make_vibrating_model, require_sweep
from study.solve.result import DRAWN_STATES

#: Columns of the figure of states that can still be read.
MOST_LEVELS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Limited:
    """What the command reports.

    Parameters
    ----------
    curves
        The limits.
    objective
        Objective, as the case names it.
    files
        Written ones.
    """

    curves: LimitCurves
    objective: str
    files: tuple[Path, ...]


def run_limits(path: Path, run: RunContext, executor: Executor | None = None) -> Limited:
    """Search for the limits of a case file, and write tables and figures.

    Parameters
    ----------
    path
        Case file.
    run
        Output folder, store and progress of the run.
    executor
        Runs the tasks of the search, such as dask's; a process for each core by default. The limits are the same.

    Raises
    ------
    CaseError
        With every mistake of the case.
    ComputationFailed
        No rest under the static load, or a process that was killed.
    """
    assert run.output is not None
    opened = open_case(path)
    case = opened.case
    sweep, table = case.sweep, case.limits
    if sweep is None and table.frequencies is None and table.first is None and table.last is None:
        require_sweep(opened)
    list_limit_points(case, table, sweep)  # before a structure is reduced, which takes minutes
    model = make_vibrating_model(read_case(opened, run=run))
    search = make_limit_search(case, table, sweep, model)
    narrow = find_narrow_resonance(search)
    if narrow is not None:
        run.warn(narrow.sentence(listed=table.frequencies is not None))
    rows = find_limits(search, path.stem, run, executor)
    output = None
    if table.objective not in FORCES:
        output = next(item for item in model.outputs if table.sensor in {None, item.name})
    motion = "" if output is None else model.motion_of(output)
    curves = convert_limits(table, output, search.harmonic, rows, motion)
    files = [run.output / f"{path.stem}_limits.{suffix}" for suffix in ("nc", "mat", "csv")]
    _save(curves.limits, files[0])
    replace_file(files[1], make_matlab_file(curves.limits.to_xarray()))
    replace_file(files[2], format_limits_csv(curves))
    drawn = _results(curves, opened.title, in_newtons=model.in_newtons)
    files += run.draw({f"{path.stem}_{name}": result for name, result in drawn.items()})
    return Limited(curves=curves, objective=table.objective, files=tuple(files))


def find_limits(search: LimitSearch, stem: str, run: RunContext, executor: Executor | None) -> FoundLimits:
    """From the store, or searched for, each task stored beside the results until all are there.

    Parameters
    ----------
    search
        Request of the case.
    stem
        Stem of the folder of finished tasks.
    run
        Output folder, store and progress of the run.
    executor
        Runs the tasks; a process for each core by default.

    Raises
    ------
    ComputationFailed
        No rest under the static load, or a process that was killed.
    """
    assert run.output is not None
    known = run.store.look_up(found_limits, search)
    if known is not None:
        return known.value
    tasks = StoredTasks(run.output / f".{stem}_limits.part", found_limits.key(search), run.warn)
    before = tasks.n_left
    if before:
        run.note(f"the search goes on: {before} of its tasks were finished before, and progress is that of the rest")
    pool = nullcontext(executor) if executor is not None else process_pool(["hbsolve.limits.search"])
    with run.progress.step("limits") as report, pool as processes:
        result = run.store.run(found_limits, search, tasks=tasks, executor=processes, report=report)
    tasks.remove()
    return result


def _save(limits: ResponseLimits, file: Path) -> None:
    """Such that a reader finds the old file or the new one."""
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / file.name
        limits.save(draft)
        replace_file(file, draft.read_bytes())


def _results(curves: LimitCurves, title: str, *, in_newtons: bool) -> dict[str, object]:
    """What is drawn, by name."""
    limits = curves.limits
    drawn: dict[str, object] = {}
    names = [f"{level:g} N" if in_newtons else f"level {level:g}" for level in limits.level]
    n_level, n_point = len(limits.level), len(limits.frequency)
    if n_point > 1:
        bands = [
            Band(
                label=names[level],
                frequency=limits.frequency,
                value=curves.value[:, level],
                sampled=curves.sampled[:, level],
                jump=curves.jump[:, level],
                repaired=curves.repaired[:, level],
            )
            for level in range(n_level)
        ]
        drawn["limits"] = LimitBands(bands=bands, title=f"{title}: {curves.quantity}", amplitude_label=curves.label)
        chosen = np.unique(np.linspace(0, n_level - 1, min(n_level, MOST_LEVELS)).round().astype(int))
        panels = [
            [
                StatePanel(
                    label=f"{SIDES[side]} limit, {names[level]}",
                    parameter=limits.frequency,
                    states=DRAWN_STATES,
                    share=curves.share[side, level],
                )
                for level in chosen
            ]
            for side in (1, 0)
        ]
        drawn["limit_states"] = ContactStates(
            panels=panels, title=f"{title}: what the contacts do at the limits", parameter_label="frequency [Hz]"
        )
    if n_level > 1:
        what = "highest points" if curves.has_peaks else "range"
        drawn["limit_levels"] = _by_level(
            curves,
            title=f"{title}: {what} of both limits",
            level_label="amplitude of the force [N]" if in_newtons else "level of the harmonic force [-]",
        )
    return drawn


def _by_level(curves: LimitCurves, title: str, level_label: str) -> LimitsByLevel:
    limits = curves.limits
    n_level, last = len(limits.level), len(limits.frequency) - 1
    value, frequency = np.full((2, 2, n_level), np.nan)
    doubtful = np.zeros((2, n_level), dtype=bool)
    for side, level in np.ndindex(2, n_level):
        at = curves.extreme(side, level)
        if at is not None:
            value[side, level] = curves.value[side, level, at]
            frequency[side, level] = limits.frequency[at]
            doubtful[side, level] = curves.jump[side, level, at] or (last > 0 and at in {0, last})
    return LimitsByLevel(
        level=limits.level, value=value, frequency=frequency, doubtful=doubtful, title=title,
        amplitude_label=curves.label, level_label=level_label,
    )  # fmt: skip
