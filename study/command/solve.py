"""``stickslip solve``: response curves of a structure with friction, gaps and other joints."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, make_command_app

app = make_command_app(
    "solve",
    """Response curves of a structure with joints, by harmonic balance and continuation around folds.

    Builds the structure of the case (a rig, a blade, a part and matrices are reduced first, unless stored) with its
    joints, loads and sensors, calibrated values and added effects. For a rig it also writes contact forces, load cells
    and a film.

    Follows the periodic response over frequency or level. Writes netCDF, CSV and figures: response curves, contact
    states, friction loops. After Ctrl-C the same command continues from there. Without a case file: a small chain.
    docs/case.md describes all keys.""",
    examples=["stickslip solve --out solved", "stickslip solve my_rig.toml --out mine --json"],
)


@app.default
def solve(
    case: Annotated[Path | None, Parameter(help="Case file; default: a small chain.")] = None,
    /,
    *,
    out: Out = Path("solved"),
    options: Options = DEFAULTS,
) -> Answer:
    """Compute response curves of a structure with joints."""
    set_one_thread_by_default()
    from study.shipped_cases import SOLVE
    from study.solve.report import format_solve_report, solve_document
    from study.solve.run import run_solve

    solved, extras = run_solve(case or SOLVE, options.open(out))
    return Answer(document=solve_document(solved, extras), text=format_solve_report(solved, extras))
