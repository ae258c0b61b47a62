"""``stickslip sweep``: response curves and limits over a grid of parameters."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, Scheduler, make_command_app

app = make_command_app(
    "sweep",
    """Response curves, and limits, of a case over a grid of its parameters.

    Each parameter is NAME=VALUES. VALUES are FIRST:LAST:NUMBER or a list with commas, with units as in the case file.
    NAME is a factor on the case's values (kt, kn, mu, zeta, E, bearing, as in [calibrated]), or a table and its key:
    wall.preload of the line or joint "wall", structure.damping.ratio, load[0].amplitude.

    Every point of the grid is the case with these values in its file. Its curves are those of `stickslip solve`;
    limits are computed if the case has [limits]. One process per core; every finished curve is stored, so the same
    command continues after Ctrl-C or a crash. Writes netCDF, CSV and figures.""",
    examples=[
        "stickslip sweep my.toml kt=0.8:1.2:5 mu=0.9,1,1.1 --out swept",
        'stickslip sweep my.toml "wall.preload=18 N:22 N:5"',
    ],
)


@app.default
def sweep(
    case: Annotated[Path, Parameter(help="Case file.")],
    /,
    *values: Annotated[str, Parameter(help="NAME=VALUES of each parameter.")],
    out: Out = Path("swept"),
    limits: Annotated[
        bool | None, Parameter(help="Also compute limits; default: if the case has a table [limits].")
    ] = None,
    scheduler: Scheduler = None,
    options: Options = DEFAULTS,
) -> Answer:
    """Compute response curves over a grid of parameters."""
    set_one_thread_by_default()
    from study.sweep.report import format_sweep_report, sweep_document
    from study.sweep.run import run_sweep

    swept = run_sweep(case, values, options.open(out, scheduler=scheduler), limits=limits)
    return Answer(document=sweep_document(swept), text=format_sweep_report(swept))
