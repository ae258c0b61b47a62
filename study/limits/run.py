"""``stickslip limits``: the band of responses that unknown friction history can produce, of a rig or a structure."""

import tempfile
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from hbsolve.matlab import make_matlab_file
from pipeline.checkpoint import StoredTasks
from pipeline.output import replace_file
from pipeline.parallel import process_pool
from pipeline.store import Stage
from study.case.setup import read_case
from study.kind.registry import OpenCase, open_case
from study.limits.curve import FoundLimits, found_limits
from study.limits.grid import find_narrow_resonance
from study.limits.model import LimitSearch, list_limit_points, make_limit_search
from study.limits.pictures import draw_limits
from study.limits.result import LimitCurves, convert_limits, format_limits_csv
from study.limits.table import FORCES, LimitsTable
from study.run_context import RunContext
from study.solve.model import SolveModel, make_vibrating_model, require_sweep

Found = TypeVar("Found")


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
    opened, model = read_limited_case(path, run)
    case, table = opened.case, opened.case.limits
    search = make_limit_search(case, table, case.sweep, model)
    warn_of_narrow_resonance(search, table, run)
    rows = find_limits(search, path.stem, run, executor)
    output = None
    if table.objective not in FORCES:
        output = next(item for item in model.outputs if table.sensor in {None, item.name})
    motion = "" if output is None else model.motion_of(output)
    curves = convert_limits(table, output, search.harmonic, rows, motion)
    files = [run.output / f"{path.stem}_limits.{suffix}" for suffix in ("nc", "mat", "csv")]
    write_netcdf_file(files[0], curves.limits.save)
    replace_file(files[1], make_matlab_file(curves.limits.to_xarray()))
    replace_file(files[2], format_limits_csv(curves))
    drawn = draw_limits(curves, opened.title, in_newtons=model.in_newtons)
    files += run.draw({f"{path.stem}_{name}": result for name, result in drawn.items()})
    return Limited(curves=curves, objective=table.objective, files=tuple(files))


def read_limited_case(path: Path, run: RunContext) -> tuple[OpenCase, SolveModel]:
    """A case and its model, refused before a structure is reduced if no search can follow: that takes minutes.

    Parameters
    ----------
    path
        Case file.
    run
        Store and progress of the run.

    Raises
    ------
    CaseError
        With every mistake of the case.
    """
    opened = open_case(path)
    case, table = opened.case, opened.case.limits
    if case.sweep is None and table.frequencies is None and table.first is None and table.last is None:
        require_sweep(opened)
    list_limit_points(case, table, case.sweep)
    return opened, make_vibrating_model(read_case(opened, run=run))


def warn_of_narrow_resonance(search: LimitSearch, table: LimitsTable, run: RunContext) -> None:
    """Say where the frequencies of a search may pass by a resonance."""
    narrow = find_narrow_resonance(search)
    if narrow is not None:
        run.warn(narrow.sentence(listed=table.frequencies is not None))


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
    return run_search(found_limits, search, stem, run, executor)


def run_search(
    searched: Stage[..., Found], search: object, stem: str, run: RunContext, executor: Executor | None
) -> Found:
    """Result of a stage of tasks, as `find_limits`.

    Parameters
    ----------
    searched
        Stage that takes the search, and its tasks, executor and progress.
    search, stem, run, executor
        See `find_limits`.

    Raises
    ------
    ComputationFailed
        See `find_limits`.
    """
    assert run.output is not None
    known = run.store.look_up(searched, search)
    if known is not None:
        return known.value
    tasks = StoredTasks(run.output / f".{stem}_limits.part", searched.key(search), run.warn)
    before = tasks.n_left
    if before:
        run.note(f"the search goes on: {before} of its tasks were finished before, and progress is that of the rest")
    pool = nullcontext(executor) if executor is not None else process_pool(["hbsolve.limits.several_limits"])
    with run.progress.step("limits") as report, pool as processes:
        result = run.store.run(searched, search, tasks=tasks, executor=processes, report=report)
    tasks.remove()
    return result


def write_netcdf_file(file: Path, save: Callable[[Path], None]) -> None:
    """Save such that a reader finds the old file or the new one."""
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / file.name
        save(draft)
        replace_file(file, draft.read_bytes())
