"""``stickslip spread``: spread of response and limits over distributions of uncertain parameters."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, Scheduler, make_command_app

app = make_command_app(
    "spread",
    """Spread of response curves, and limits, over the uncertain parameters of a case.

    Each [[uncertain]] table of the case names a parameter and its distribution: normal, lognormal or uniform. To first
    order the spread follows from exact derivatives of the curves at the means. Draws of a scrambled Sobol sequence give
    the bands that contain 90 % of the curves, and the first-order and total Sobol indices of each parameter for peak
    frequency, peak amplitude, equivalent damping and limits.

    With d parameters, n draws need n (d + 2) points; limits are computed at each if the case has [limits]. One
    process per core; every finished curve is stored, so the same command continues after Ctrl-C or a crash. Writes
    netCDF, CSV and figures.""",
    examples=["stickslip spread my.toml --out spread", "stickslip spread my.toml --draws 0"],
)


@app.default
def spread(
    case: Annotated[Path, Parameter(help="Case file with [[uncertain]].")],
    /,
    *,
    out: Out = Path("spread"),
    draws: Annotated[int, Parameter(help="Number of draws, a power of two; 0: first order only.")] = 64,
    seed: Annotated[int, Parameter(help="Seed of the draws.")] = 0,
    limits: Annotated[
        bool | None, Parameter(help="Also compute limits; default: if the case has a table [limits].")
    ] = None,
    scheduler: Scheduler = None,
    options: Options = DEFAULTS,
) -> Answer:
    """Compute the spread of a response."""
    set_one_thread_by_default()
    from study.spread.report import format_spread_report, spread_document
    from study.spread.run import run_spread

    result = run_spread(case, options.open(out, scheduler=scheduler), draws=draws, seed=seed, limits=limits)
    return Answer(document=spread_document(result), text=format_spread_report(result))
