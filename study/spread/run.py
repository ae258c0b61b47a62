"""``stickslip spread``: the spread of a response as tables and figures."""

from dataclasses import replace
from pathlib import Path

from study.kind.registry import open_case
from study.run_context import RunContext
from study.spread.pictures import draw_spread
from study.spread.result import format_quantities_csv, make_spread_dataset
from study.spread.spread import Spread, spread
from study.sweep.result import format_peaks_csv


def run_spread(path: Path, run: RunContext, *, draws: int = 64, seed: int = 0, limits: bool | None = None) -> Spread:
    """Run `spread` with one process per core or the scheduler of the run, and write tables and figures.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them. Or an invalid number of draws.
    ComputationFailed
        No curve could be started.
    """
    result = spread(path, draws=draws, seed=seed, limits=limits, run=run, workers=run.scheduler)
    title, stem = open_case(path).title, f"{path.stem}_spread"
    content: dict[str, str | bytes] = {
        f"{stem}.nc": bytes(make_spread_dataset(result, title).to_netcdf(engine="h5netcdf")),
        f"{stem}.csv": format_quantities_csv(result),
    }
    if result.sampled.curves is not None:
        content[f"{stem}_draws.csv"] = format_peaks_csv(result.sampled)
    files = run.write_files(content)
    drawn = run.draw({f"{path.stem}_{name}": figure for name, figure in draw_spread(result, title).items()})
    return replace(result, files=(*files, *drawn))
