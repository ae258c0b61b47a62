"""Report of a comparison, as text and as a document."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from correlation.campaign.measurement import name_configuration
from correlation.metric.jump_error import JumpError
from correlation.metric.misfit import (
    AXES,
    Misfit,
    MisfitSummary,
    find_worst,
    find_worst_cell,
    split_misfit,
    summarise_misfit,
)
from correlation.metric.peak_error import PeakError
from diagnosis.fit.unknown_gain import GAIN, describe_gain
from geometry.plain_number import count, format_number
from study.compare.data import describe_data, document_data
from study.compare.result import SWEEP_WORDS, ComparisonResult
from study.compare.sentence import CLEAR_PEAK, summarise

#: Phase errors below this are not reported [deg]; static parts, and responses absent from the model, have none.
NO_PHASE = 0.05
#: Name of the worst item along each axis.
WORDS = {axis: f"worst {axis}" for axis in AXES}


def format_report(compared: ComparisonResult) -> str:
    """Report as text: the compared data, where and by how much the model fails, and its resonances."""
    table, unit = compared.campaign.measurement, compared.campaign.drive.unit
    levels = ", ".join(f"{level:g}" for level in compared.campaign.levels)
    lines = [
        f"{join_titles(compared.title, compared.campaign.title)}: "
        f"{count(len(compared.campaign.sensors), 'sensor')}, {levels} {unit}, "
        f"{count(len(np.unique(table.repeat)), 'repeat')}",
        "",
    ]
    lines += _describe_calibrated(compared)
    summary = summarise(compared)
    lines += [f"{summary.tag}.", *summary.sentences, ""]
    for name, misfit in _list_sides(compared).items():
        lines += [*_describe_side(name, misfit, compared.campaign.drive.unit), ""]
    if compared.peaks:
        lines += [*_format_peaks(compared), ""]
    if compared.unread or compared.jumps:
        lines += [
            *(f"Not read: {reason}." for reason in compared.unread),
            *(describe_jump(jump, unit) for jump in compared.jumps),
            "",
        ]
    if compared.data:
        lines += [*describe_data(compared.data), ""]
    if compared.families is not None:
        from study.compare.family_report import format_family_report

        lines += format_family_report(compared.families)
    pages = [file for file in compared.files if file.suffix == ".html"]
    lines += [summary.next, *(f"The page with all curves, maps and residuals: {file}" for file in pages), ""]
    return "\n".join([*lines, *map(str, compared.files)])


def make_document(compared: ComparisonResult) -> dict[str, Any]:
    """Report for ``--json``; errors of the prediction are relative and in radians."""
    summary, families, unit = summarise(compared), None, compared.campaign.drive.unit
    if compared.families is not None:
        from study.compare.family_report import document_families

        families = document_families(compared.families)
    return {
        "title": compared.title,
        "campaign": compared.campaign.title,
        "summary": [summary.tag, *summary.sentences],
        "suspicions": [str(item) for item in compared.suspicions],
        "calibrated": {item.name: {"factor": item.factor, "deviation": item.deviation} for item in compared.calibrated},
        "sets": {name: _document_misfit(misfit, unit) for name, misfit in _list_sides(compared).items()},
        "resonances": [
            {
                "configuration": name_configuration(peak.free),
                "mode": peak.mode,
                "level_n": peak.level,
                "level_unit": unit,
                "sensor": peak.sensor,
                "frequency_hz": peak.frequency,
                "frequency_deviation_hz": peak.frequency_deviation,
                "predicted_frequency_hz": peak.predicted_frequency,
                "frequency_error": peak.frequency_error,
                "damping_ratio": peak.damping,
                "damping_deviation": peak.damping_deviation,
                "predicted_damping_ratio": peak.predicted_damping,
                "damping_error": peak.damping_error,
            }
            for peak in compared.peaks
        ],
        "jumps": [
            {
                "configuration": name_configuration(jump.free),
                "level_n": jump.level,
                "level_unit": unit,
                "sweep": SWEEP_WORDS[jump.sweep],
                "direction": "down" if jump.falls else "up",
                "frequency_hz": jump.frequency,
                "frequency_deviation_hz": jump.frequency_deviation,
                "predicted_frequency_hz": jump.predicted_frequency,
                "swept_both_ways": jump.swept_both_ways,
            }
            for jump in compared.jumps
        ],
        "unread_resonances": list(compared.unread),
        "data": document_data(compared.data),
        "families": families,
        "files": [str(file) for file in compared.files],
    }


def join_titles(case: str, campaign: str) -> str:
    """Titles of a case and of a campaign: a single one if they are equal or one is empty."""
    return " beside ".join(dict.fromkeys(filter(None, [case, campaign])))


def _list_sides(compared: ComparisonResult) -> Mapping[str, Misfit]:
    sides = {"training": compared.train}
    return sides if compared.held_out is None else sides | {"held out": compared.held_out}


def _document_misfit(misfit: Misfit, unit: str) -> dict[str, Any]:
    cell, points = find_worst_cell(misfit, unit)
    return {
        **_document_summary(summarise_misfit(misfit)),
        "n_not_found": _count_not_found(misfit),
        "worst_cell": {
            **_document_summary(cell),
            "configuration": name_configuration(bool(points.free[0])),
            "level_n": float(points.level[0]),
            "level_unit": unit,
            "frequencies_hz": [float(points.frequency.min()), float(points.frequency.max())],
            "sensor": str(points.sensor[0]),
            "harmonic": int(points.harmonic[0]),
        },
        "by": {axis: [_document_summary(summary) for summary in split_misfit(misfit, axis, unit)] for axis in AXES},
    }


def _document_summary(summary: MisfitSummary) -> dict[str, Any]:
    return {
        "label": summary.label,
        "standard_deviations": summary.deviations,
        "whitened": summary.whitened,
        "median_amplitude_error": summary.amplitude_error,
        "median_phase_error_rad": summary.phase_error,
        "n_number": summary.n_number,
    }


def _count_not_found(misfit: Misfit) -> int:
    return int((~np.isfinite(misfit.predicted)).sum())


def _describe_calibrated(compared: ComparisonResult) -> list[str]:
    if not compared.calibrated:
        return []
    factors = [item for item in compared.calibrated if not item.name.startswith(GAIN)]
    gains = [describe_gain(*vars(item).values()) for item in compared.calibrated if item.name.startswith(GAIN)]
    values = ", ".join(f"{item.name} x {item.factor:.4f}" for item in factors)
    return [
        *([f"Calibrated on the training data: {values} (stickslip diagnose gives their intervals)"] if factors else []),
        *([f"Unknown gains, fitted to the training data: {', '.join(gains)}"] if gains else []),
        "",
    ]


def _describe_side(name: str, misfit: Misfit, unit: str) -> Iterator[str]:
    all_of = summarise_misfit(misfit)
    mean = f"all together {all_of.whitened:.3g} times as large as expected by chance (root of reduced chi^2)"
    yield f"{name}: {all_of.n_number} numbers, {mean}"
    missing = _count_not_found(misfit)
    if missing:
        yield f"  no steady state was found at {missing} of {len(misfit)} points; each counts 10 standard deviations"
    rows = [(WORDS[axis], find_worst(split)) for axis in AXES if len(split := split_misfit(misfit, axis, unit)) > 1]
    width = max([len(summary.label) for _, summary in rows] + [len("all points")])
    yield f"  {'point by point':<19}  {'':<{width}}  standard deviations  median error of amplitude and phase"
    for what, summary in [("all", all_of), *rows]:
        label = "all points" if summary is all_of else summary.label
        yield f"  {what:<19}  {label:<{width}}  {summary.deviations:19.3g}  {_format_errors(summary)}"
    cell, _ = find_worst_cell(misfit, unit)
    yield f"  worst of all: {cell.label}: {cell.deviations:.3g} standard deviations of a point{_describe_signed(cell)}"


def _format_errors(summary: MisfitSummary) -> str:
    if not np.isfinite(summary.amplitude_error):
        return "none exceeds the noise"
    phase = f"{np.degrees(summary.phase_error):6.2f} deg" if np.isfinite(summary.phase_error) else ""
    return f"{100 * summary.amplitude_error:6.2f} %  {phase}"


def _describe_signed(cell: MisfitSummary) -> str:
    if not np.isfinite(cell.signed_amplitude_error):
        return ""
    amplitude, phase = cell.signed_amplitude_error, np.degrees(cell.signed_phase_error)
    side = "large" if amplitude > 0 else "small"
    sentence = f"; there the model's amplitude is {format_number(100 * abs(amplitude), 3)} % too {side}"
    if not abs(phase) > NO_PHASE:
        return sentence
    return f"{sentence} and its phase {format_number(abs(phase), 3)} deg too {'early' if phase > 0 else 'late'}"


def _format_peaks(compared: ComparisonResult) -> Iterator[str]:
    unit = compared.campaign.drive.unit
    yield "Resonances, and the error of the model in % and, in brackets, in standard deviations:"
    yield "  structure  mode     level   frequency [Hz]     error             damping     error"
    for peak in compared.peaks:
        frequency = _format_error(peak.frequency_error, peak.frequency, peak.frequency_deviation, 3)
        damping = _format_error(peak.damping_error, peak.damping, peak.damping_deviation, 1)
        yield (
            f"  {name_configuration(peak.free):<9}  {peak.mode:4}  {peak.level:6g} {unit}  {peak.frequency:15.3f}  "
            f"{frequency:<17}  "
            f"{100 * peak.damping:6.3f} %  {damping}{_format_held_out(compared, peak)}"
        )

    peak, what, deviations = max(
        (
            (peak, what, abs(error) * value / deviation)
            for peak in compared.peaks
            for what, error, value, deviation in (
                ("frequency", peak.frequency_error, peak.frequency, peak.frequency_deviation),
                ("damping", peak.damping_error, peak.damping, peak.damping_deviation),
            )
            if deviation > 0 and np.isfinite(error)
        ),
        key=lambda item: item[2],
        default=(compared.peaks[0], "", 0.0),
    )
    if deviations > CLEAR_PEAK:
        error = peak.frequency_error if what == "frequency" else peak.damping_error
        yield (
            f"  worst: the {what} of mode {peak.mode} of the {name_configuration(peak.free)} structure at "
            f"{peak.level:g} {unit} is {format_number(100 * abs(error), 3)} % too {'high' if error > 0 else 'low'} "
            f"({deviations:.3g} standard deviations)"
        )


def describe_jump(jump: JumpError, level_unit: str) -> str:
    """``jointed, 3 N, up-sweep: jumps down at 25.1 Hz, the model at 24.6 Hz (-0.5 Hz)``."""
    where = f"{name_configuration(jump.free)}, {jump.level:g} {level_unit}, {'up' if jump.sweep > 0 else 'down'}-sweep"
    way = "down" if jump.falls else "up"
    if not np.isfinite(jump.frequency):
        return f"{where}: the model jumps {way} at {jump.predicted_frequency:.5g} Hz, the measured response does not"
    seen = f"{where}: jumps {way} at {jump.frequency:.5g} Hz"
    if not np.isfinite(jump.predicted_frequency):
        doubt = "" if jump.swept_both_ways else " (or has a steep flank there: one sweep cannot tell)"
        return f"{seen}{doubt}, the model does not"
    return f"{seen}, the model at {jump.predicted_frequency:.5g} Hz ({jump.frequency_error:+.3g} Hz)"


def _format_error(relative: float, value: float, deviation: float, digits: int) -> str:
    if not np.isfinite(relative):
        return "not in the model"
    if not np.isfinite(deviation) or deviation <= 0:
        return f"{100 * relative:+.{digits}f} %"
    return f"{100 * relative:+.{digits}f} % ({abs(relative) * value / deviation:.1f})"


def _format_held_out(compared: ComparisonResult, peak: PeakError) -> str:
    return "" if np.isin(peak.level, compared.train.points.level) else "  held out"
