"""``stickslip sweep``: response curves and limits of a case over a grid of its parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.worker_pool import Workers
from study.case.setup import read_case
from study.case.sweep_table import ControlledSweepTable
from study.kind.registry import OpenCase, open_case
from study.run_context import RunContext, silent_run
from study.solve.model import make_solve_model, require_sweep
from study.sweep.grid import Grid, read_grid
from study.sweep.limits import asks_for_limits, compute_limits
from study.sweep.parameter import require_factors
from study.sweep.pictures import draw_sweep
from study.sweep.result import (
    SampledCase,
    format_curves_csv,
    format_limits_csv,
    format_peaks_csv,
    make_dataset,
)
from study.sweep.samples import compute_curves

#: Requested values of each parameter by its name, or words NAME=VALUES.
Values = Mapping[str, str | Sequence[float | str]] | Sequence[str]


@dataclass(frozen=True, kw_only=True, eq=False)
class SweepResult:
    """Result of a sweep.

    Parameters
    ----------
    grid
        Grid of the sweep.
    sampled
        Curves and limits at the points of the grid, in their order.
    files
        Written files.
    """

    grid: Grid
    sampled: SampledCase
    files: tuple[Path, ...] = ()


def sweep(
    path: Path | str,
    values: Values,
    *,
    limits: bool | None = None,
    run: RunContext | None = None,
    workers: Workers = 1,
) -> SweepResult:
    """Compute response curves, and limits, of a case over a grid of its parameters; nothing is written.

    Parameters
    ----------
    path
        Case file.
    values
        Values of each parameter by its name, such as ``{"mu": [0.8, 1.2], "wall.preload": "18 N:22 N:5"}``; or words
        ``NAME=VALUES`` as on the command line.
    limits
        Whether limits are searched for; by default if the case has a table [limits].
    run
        Store and progress; none by default.
    workers
        Number of processes [-]; only this process by default. With more, or None for one per core, a script needs
        ``if __name__ == "__main__":``. Or the address of a dask scheduler.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them. Or a mistake of the grid.
    ComputationFailed
        No curve could be started.
    """
    opened = open_case(path)
    run = run or silent_run()
    grid = read_grid(opened, values)
    points = [grid.at(point) for point in grid.points()]
    numbers = np.array(grid.points(), dtype=np.float64)
    with_limits = asks_for_limits(opened) if limits is None else limits
    require_curves_or_limits(opened, with_limits=with_limits)
    read = read_case(opened, run=run)
    require_factors(read, grid.parameters)
    curves = None
    if opened.case.sweep is not None:
        curves = compute_curves(opened, points, make_solve_model(read), run, workers)
        warn_of_failures(curves.failures, len(points) * len(curves.model.curves), run)
    result = compute_limits(opened, points, Path(path).stem, run, workers) if with_limits else ()
    return SweepResult(
        grid=grid, sampled=SampledCase(parameters=grid.parameters, values=numbers, curves=curves, limits=result)
    )


def require_curves_or_limits(opened: OpenCase, *, with_limits: bool) -> None:
    """Refuse a case without curves and limits, or with curves that have no peak.

    Raises
    ------
    CaseError
        The case has no [sweep] and no limits are requested, or its [sweep] controls an amplitude.
    """
    if isinstance(opened.case.sweep, ControlledSweepTable):
        raise opened.lacks(
            "sweep",
            "control keeps the amplitude constant, so the curves have no peak to compare: give levels instead of "
            "control and amplitudes, or compute the curves of each value with `stickslip solve`",
        )
    if not with_limits:
        require_sweep(opened)


def warn_of_failures(failures: Sequence[str], count: int, run: RunContext) -> None:
    """Warn of incomplete curves, with their number and the reason of the first."""
    if failures:
        run.warn(f"{len(failures)} of {count} curves do not reach the end of their range; the first one: {failures[0]}")


def run_sweep(path: Path, words: Sequence[str], run: RunContext, *, limits: bool | None = None) -> SweepResult:
    """Run `sweep` with one process per core or the scheduler of the run, and write tables and figures.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them. Or a mistake of the grid.
    ComputationFailed
        No curve could be started.
    """
    swept = sweep(path, words, limits=limits, run=run, workers=run.scheduler)
    title = open_case(path).title
    files = write_samples(swept.sampled, f"{path.stem}_sweep", title, run)
    drawn = draw_sweep(swept.grid, swept.sampled, title)
    files += run.draw({f"{path.stem}_{name}": result for name, result in drawn.items()})
    return SweepResult(grid=swept.grid, sampled=swept.sampled, files=tuple(files))


def write_samples(sampled: SampledCase, stem: str, title: str, run: RunContext) -> list[Path]:
    """Write curves and limits of all points as netCDF and CSV."""
    content: dict[str, str | bytes] = {
        f"{stem}.nc": bytes(make_dataset(sampled, title).to_netcdf(engine="h5netcdf")),
    }
    if sampled.curves is not None:
        content[f"{stem}.csv"] = format_curves_csv(sampled)
        content[f"{stem}_peaks.csv"] = format_peaks_csv(sampled)
    if sampled.limits:
        content[f"{stem}_limits.csv"] = format_limits_csv(sampled)
    return list(run.write_files(content))
