"""Report of ``stickslip solve``: a table of text and a JSON document."""

from typing import Any

from geometry.plain_number import count
from study.kind.registry import Extras
from study.solve.result import CurveSummary
from study.solve.run import SolveResult


def solve_document(solved: SolveResult, extras: Extras | None = None) -> dict[str, Any]:
    """Make the document of ``--json``, with the additions of the case's kind."""
    added = dict(extras.document) if extras else {}
    of_curves = added.pop("curves", [{} for _ in solved.peaks])
    return {
        "n_dof": solved.model.system.n_dof,
        "n_joint": len(solved.model.system.joints),
        "harmonics": solved.model.harmonics,
        "highest_harmonic": _find_highest(solved),
        "output": solved.model.outputs[0].name,
        **_document_motions(solved),
        "curves": [vars(peak) | more for peak, more in zip(solved.peaks, of_curves, strict=True)],
        **added,
        "files": [str(file) for file in (*solved.files, *(extras.files if extras else ()))],
    }


def format_solve_report(solved: SolveResult, extras: Extras | None = None) -> str:
    """Format the report as a table."""
    model, highest = solved.model, _find_highest(solved)
    refined = f", up to {highest} where refined" if highest > model.harmonics else ""
    width = max(len(peak.label) for peak in solved.peaks)
    lines = [extras.text] if extras and extras.text else []
    control = model.curves[0].control
    which = f"points of the smallest force that controls {control.sensor}, and" if control else "highest points of"
    lines += [
        f"{model.system.n_dof} degrees of freedom, {count(len(model.system.joints), 'joint')}, "
        f"harmonics 0 to {model.harmonics}{refined}; {which} {model.outputs[0].name}:",
        "",
        f"  {'curve':<{width}}  frequency [Hz]     level  amplitude [{solved.peaks[0].unit}]  points  "
        "truncation error at the peak",
    ]
    for peak in solved.peaks:
        wide = len(f"amplitude [{peak.unit}]")
        at_end = "  at the end of the sweep" if peak.peak_at_end else ""
        lines.append(
            f"  {peak.label:<{width}}  {peak.peak_frequency_hz:14.5f}  {peak.peak_level:8.4g}"
            f"  {peak.peak_amplitude:{wide}.5g}  {peak.n_point:6}  {peak.peak_truncation_error:28.1e}{at_end}"
        )
    lines += ["", *(f"  {peak.label}: {peak.stop_reason}" for peak in solved.peaks)]
    if solved.model.stability:
        lines += ["", *(f"  {peak.label}: {_describe_bifurcations(peak)}" for peak in solved.peaks)]
    words = {"absolute": "absolute motion", "relative": "motion relative to the base"}
    lines += [f"  {name}: {words[motion]}" for name, motion in _document_motions(solved).get("motion", {}).items()]
    lines += ["", *map(str, solved.files)]
    lines += map(str, extras.files if extras else ())
    return "\n".join(lines)


def _find_highest(solved: SolveResult) -> int:
    """Highest harmonic of all points [-]."""
    return max(int(item.branch.highest_harmonic.max()) for item in solved.curves)


def _document_motions(solved: SolveResult) -> dict[str, dict[str, str]]:
    """Document whether each sensor reads the motion absolute or relative to a moving base; empty for a fixed base."""
    model = solved.model
    return {} if model.base is None else {"motion": {item.name: model.motion_of(item) for item in model.outputs}}


def _describe_bifurcations(peak: CurveSummary) -> str:
    """Describe the points at which the stability of a curve changes."""
    points = [
        f"{item['kind']} at {item['frequency_hz']:.6g} Hz, level {item['level']:.4g}"
        for item in peak.bifurcations or ()
    ]
    return "; ".join(points) or "its stability does not change"
