"""``stickslip limits``: the band of responses that unknown friction history can produce, for any kind of structure."""

import tempfile
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from hbsolve.matlab import make_matlab_file
from pipeline.output import replace_file
from study.case.model_doubt import warn_of_model
from study.case.setup import read_case
from study.kind.registry import OpenCase, open_case
from study.limits.curve import search_limits
from study.limits.grid import find_narrow_resonance
from study.limits.model import LimitSearch, list_limit_points, make_limit_search
from study.limits.pictures import draw_limits
from study.limits.result import LimitCurves, convert_own_limits, format_limits_csv
from study.limits.stored_search import run_search
from study.limits.table import LimitsTable
from study.run_context import RunContext
from study.solve.model import SolveModel, make_vibrating_model, require_sweep


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitsResult:
    """Result of the command.

    Parameters
    ----------
    curves
        Limits.
    objective
        Name of the objective in the case.
    files
        Written files.
    """

    curves: LimitCurves
    objective: str
    files: tuple[Path, ...]


def run_limits(path: Path, run: RunContext, executor: Executor | None = None) -> LimitsResult:
    """Search for the limits of a case file, and write tables and figures.

    Parameters
    ----------
    path
        Case file.
    run
        Output folder, store and progress of the run.
    executor
        Executor of the tasks of the search, such as dask's; a process for each core by default. The limits do not
        depend on it.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them.
    ComputationFailed
        There is no state of rest under the static load, or a process was killed.
    """
    assert run.output is not None
    opened, model = read_limited_case(path, run)
    case, table = opened.case, opened.case.limits
    search = make_limit_search(case, table, case.sweep, model)
    warn_of_narrow_resonance(search, table, run)
    limits = run_search(search_limits, search, path.stem, run, executor)
    curves = convert_own_limits(search, table, limits, model, run)
    files = [run.output / f"{path.stem}_limits.{suffix}" for suffix in ("nc", "mat", "csv")]
    write_netcdf_file(files[0], curves.limits.save)
    replace_file(files[1], make_matlab_file(curves.limits.to_xarray()))
    replace_file(files[2], format_limits_csv(curves))
    drawn = draw_limits(curves, opened.title, in_newtons=model.in_newtons)
    files += run.draw({f"{path.stem}_{name}": result for name, result in drawn.items()})
    return LimitsResult(curves=curves, objective=table.objective, files=tuple(files))


def read_limited_case(path: Path, run: RunContext) -> tuple[OpenCase, SolveModel]:
    """Read a case for a search and make its model; mistakes are reported before the reduction, which takes minutes.

    Parameters
    ----------
    path
        Case file.
    run
        Store and progress of the run.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them.
    """
    opened = open_case(path)
    case, table = opened.case, opened.case.limits
    if case.sweep is None and table.frequencies is None and table.first is None and table.last is None:
        require_sweep(opened)
    list_limit_points(case, table, case.sweep)
    read = read_case(opened, run=run)
    warn_of_model(case, read.model.system, swept=table.frequencies is None and table.first is None)
    return opened, make_vibrating_model(read)


def warn_of_narrow_resonance(search: LimitSearch, table: LimitsTable, run: RunContext) -> None:
    """Warn of a resonance that may be between the frequencies of a search."""
    narrow = find_narrow_resonance(search)
    if narrow is not None:
        run.warn(narrow.sentence(listed=table.frequencies is not None))


def write_netcdf_file(file: Path, save: Callable[[Path], None]) -> None:
    """Replace a netCDF file at once, so that a reader finds the old or the new file."""
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / file.name
        save(draft)
        replace_file(file, draft.read_bytes())
