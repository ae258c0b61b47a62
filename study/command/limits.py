"""``stickslip limits``: the band of responses that unknown friction history can produce."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, Scheduler, make_command_app

app = make_command_app(
    "limits",
    """Lower and upper limit of the steady response over all friction histories.

    For cases whose sliding joints are friction contacts with one tangent, or two uncoupled ones, Jenkins joints, and
    lines of these. Searches for the smallest and largest amplitude of a sensor, or force of a contact, over all
    initial slider positions, at each frequency and level, in one process per core; with objective = "all", those of
    every sensor and of the forces of every contact line in one run. The limits are tested by random histories.
    Writes netCDF, CSV and figures: the band, contact states, limits against level. Each finished task is stored:
    after Ctrl-C or a crash the same command continues from there. The keys of [limits] are described in
    docs/case.md.""",
    examples=["stickslip limits --out limited", "stickslip limits rig.toml --out limited --json"],
)


@app.default
def limits(
    case: Annotated[Path | None, Parameter(help="Case file; default: a blade with a wedge damper.")] = None,
    /,
    *,
    out: Out = Path("limited"),
    scheduler: Scheduler = None,
    options: Options = DEFAULTS,
) -> Answer:
    """Search for the limits of the response over all friction histories."""
    set_one_thread_by_default()
    from study.limits.report import document_limits, format_limits_report
    from study.limits.run import run_limits
    from study.limits.several.report import document_several_limits, format_several_limits_report
    from study.limits.several.run import run_several_limits, searches_all_quantities
    from study.shipped_cases import LIMITS

    path = case or LIMITS
    if searches_all_quantities(path):
        several = run_several_limits(path, options.open(out, scheduler=scheduler))
        return Answer(document=document_several_limits(several), text=format_several_limits_report(several))
    limited = run_limits(path, options.open(out, scheduler=scheduler))
    return Answer(document=document_limits(limited), text=format_limits_report(limited))
