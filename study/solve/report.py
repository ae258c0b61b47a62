"""What ``stickslip solve`` says of response curves: a table for people, a document for programs."""

from typing import Any

from study.case.kind import Extras
from study.solve.run import Solved


def solve_document(solved: Solved, extras: Extras | None = None) -> dict[str, Any]:
    """The document of ``--json``, with what the kind of the case adds."""
    added = dict(extras.document) if extras else {}
    of_curves = added.pop("curves", [{} for _ in solved.peaks])
    return {
        "n_dof": solved.model.system.n_dof,
        "n_joint": len(solved.model.system.joints),
        "harmonics": solved.model.harmonics,
        "output": solved.model.outputs[0].name,
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
                **more,
            }
            for peak, more in zip(solved.peaks, of_curves, strict=True)
        ],
        **added,
        "files": [str(file) for file in (*solved.files, *(extras.files if extras else ()))],
    }


def solve_text(solved: Solved, extras: Extras | None = None) -> str:
    """The same as a table."""
    model = solved.model
    width = max(len(peak.label) for peak in solved.peaks)
    lines = [extras.text] if extras and extras.text else []
    lines += [
        f"{model.system.n_dof} degrees of freedom, {len(model.system.joints)} joints, "
        f"harmonics 0 to {model.harmonics}; highest points of {model.outputs[0].name}:",
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
    lines += map(str, extras.files if extras else ())
    return "\n".join(lines)
