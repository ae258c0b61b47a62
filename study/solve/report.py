"""What ``stickslip solve`` says of response curves: a table for people, a document for programs."""

from typing import Any

from study.solve.run import Solved


def solve_document(solved: Solved) -> dict[str, Any]:
    """The document of ``--json``."""
    return {
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


def solve_text(solved: Solved) -> str:
    """The same as a table."""
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
    return "\n".join(lines)
