"""``stickslip solve``: response curves of a structure with friction, gaps and other joints."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, Out, command_app

app = command_app(
    "solve",
    """Response curves of a structure with joints, by harmonic balance and continuation round folds.

    Reads mass, damping and stiffness (.npz, .mat, or .h5 as `stickslip reduce` writes it), puts the case's contacts,
    loads and outputs on it, and follows the periodic response over frequency or level. Writes netCDF, CSV and figures:
    response curves, contact states, friction loops. Ctrl-C keeps what is done: the same command goes on from there.
    Without a case file: a small chain. Every key stands in docs/solve_case.md.""",
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
    from study.shipped import SOLVE
    from study.solve_run import run_solve

    solved = run_solve(case or SOLVE, options.open(out))
    width = max(len(peak.label) for peak in solved.peaks)
    lines = [
        f"{solved.n_dof} degrees of freedom, {solved.n_joint} joints, harmonics 0 to {solved.harmonics}; "
        f"highest points of {solved.output}:",
        "",
        f"  {'curve':<{width}}  frequency [Hz]     level  amplitude [{solved.peaks[0].unit}]  points  "
        "truncation error at the peak",
    ]
    for peak in solved.peaks:
        amplitude_width = len(f"amplitude [{peak.unit}]")
        lines.append(
            f"  {peak.label:<{width}}  {peak.frequency:14.5f}  {peak.level:8.4g}  {peak.amplitude:{amplitude_width}.5g}"
            f"  {peak.n_point:6}  {peak.truncation_error:28.1e}{'  at the end of the sweep' if peak.at_end else ''}"
        )
    lines += ["", *(f"  {peak.label}: {peak.stop_reason}" for peak in solved.peaks), "", *map(str, solved.files)]
    document = {
        "n_dof": solved.n_dof,
        "n_joint": solved.n_joint,
        "harmonics": solved.harmonics,
        "output": solved.output,
        "curves": [
            {
                "label": peak.label,
                "peak_frequency_hz": peak.frequency,
                "peak_level": peak.level,
                "peak_amplitude": peak.amplitude,
                "unit": peak.unit,
                "peak_at_end": peak.at_end,
                "n_point": peak.n_point,
                "peak_truncation_error": peak.truncation_error,
                "truncation_error": peak.largest_truncation_error,
                "stop_reason": peak.stop_reason,
            }
            for peak in solved.peaks
        ],
        "files": [str(file) for file in solved.files],
    }
    return Answer(document=document, text="\n".join(lines))
