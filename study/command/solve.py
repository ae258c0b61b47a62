"""``stickslip solve``: response curves of a structure with friction, gaps and other joints."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, command_app

app = command_app(
    "solve",
    """Response curves of a structure with joints, by harmonic balance and continuation round folds.

    A rig's case (docs/rig.md): reduces its bodies unless that was done before, finds rest under the dead weights, and
    writes contact forces, load cells and a film as well.

    Any other case: reads mass, damping and stiffness (.npz, .mat, or .h5 as `stickslip reduce` writes it), and puts
    the case's contacts, loads and outputs on it.

    Follows the periodic response over frequency or level. Writes netCDF, CSV and figures: response curves, contact
    states, friction loops. Ctrl-C keeps what is done: the same command goes on from there. Without a case file: a small
    chain. Every key stands in docs/solve_case.md.""",
    examples=["stickslip solve --out solved", "stickslip solve my_rig.toml --out mine --json"],
)


@app.default
def solve(
    case: Annotated[Path | None, Parameter(help="Case file.")] = None,
    /,
    *,
    out: Out = Path("solved"),
    options: Options = DEFAULTS,
) -> Answer:
    """Compute response curves of a structure with joints."""
    one_thread_by_default()
    from study.kind.matrices.table import is_matrices_case
    from study.kind.part.table import refuse_part
    from study.kind.rig.table import is_rig_case
    from study.shipped import SOLVE

    path = case or SOLVE
    if is_matrices_case(path):
        from study.kind.matrices.reduce import refuse_to_solve

        refuse_to_solve(path)
    refuse_part(path, f"`stickslip reduce {path}` makes the model that a case of `stickslip solve` names")
    if is_rig_case(path):
        from study.kind.rig.solve import run_solve_rig
        from study.kind.rig.solve_report import rig_solve_document, rig_solve_text

        rig = run_solve_rig(path, options.open(out))
        return Answer(document=rig_solve_document(rig), text=rig_solve_text(rig))
    from study.solve.report import solve_document, solve_text
    from study.solve.run import run_solve

    solved = run_solve(path, options.open(out))
    return Answer(document=solve_document(solved), text=solve_text(solved))
