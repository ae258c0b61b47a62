"""``stickslip limits`` of all quantities: amplitudes and the forces of all lines, by one search."""

from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

from hbsolve.limits.several_result import join_limits, save_several_limits
from hbsolve.matlab import make_matlab_file
from pipeline.output import replace_file
from study.kind.registry import open_case
from study.limits.result import LimitCurves
from study.limits.run import read_limited_case, warn_of_narrow_resonance, write_netcdf_file
from study.limits.several.pictures import draw_several_limits
from study.limits.several.quantity import Quantity
from study.limits.several.result import format_several_csv
from study.limits.several.search import convert_several_limits, make_several_search, search_several_limits
from study.limits.stored_search import run_search
from study.limits.table import EVERYTHING
from study.run_context import RunContext


@dataclass(frozen=True, kw_only=True, eq=False)
class SeveralLimitsResult:
    """Result of the command.

    Parameters
    ----------
    quantities, curves
        Quantities and their limits, in the same order.
    files
        Written files.
    """

    quantities: tuple[Quantity, ...]
    curves: tuple[LimitCurves, ...]
    files: tuple[Path, ...]


def searches_all_quantities(path: Path) -> bool:
    """Whether [limits] of a case has objective = "all".

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them.
    """
    return open_case(path).case.limits.objective == EVERYTHING


def run_several_limits(path: Path, run: RunContext, executor: Executor | None = None) -> SeveralLimitsResult:
    """Search for the limits of all quantities of a case file, and write tables and figures.

    Parameters
    ----------
    path
        Case file.
    run
        Output folder, store and progress of the run.
    executor
        Executor of the tasks of the search; a process for each core by default. The limits do not depend on it.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them.
    ComputationFailed
        There is no state of rest under the static load, or a process was killed.
    """
    assert run.output is not None
    opened, model = read_limited_case(path, run)
    search, quantities = make_several_search(opened.case, opened.case.limits, opened.case.sweep, model)
    warn_of_narrow_resonance(search.first, opened.case.limits, run)
    searched = run_search(search_several_limits, search, path.stem, run, executor)
    curves = convert_several_limits(search, quantities, searched, model, run)
    limits = {item.name: own.limits for item, own in zip(quantities, curves, strict=True)}
    units = {item.name: "N" if item.output is None else "m" for item in quantities}
    files = [run.output / f"{path.stem}_limits.{suffix}" for suffix in ("nc", "mat", "csv")]
    write_netcdf_file(files[0], lambda draft: save_several_limits(limits, units, draft))
    replace_file(files[1], make_matlab_file(join_limits(limits, units)))
    replace_file(files[2], format_several_csv(curves))
    drawn = draw_several_limits(quantities, curves, opened.title, in_newtons=model.in_newtons)
    files += run.draw({f"{path.stem}_{name}": result for name, result in drawn.items()})
    return SeveralLimitsResult(quantities=quantities, curves=curves, files=tuple(files))
