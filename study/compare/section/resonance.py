"""Resonances: frequency and damping of every mode and level, measured and predicted, as a table and as a backbone."""

from collections.abc import Iterator

import numpy as np

from correlation.campaign.measurement import name_configuration
from correlation.metric.peak_error import PeakError
from study.compare.backbone import draw_backbones
from study.compare.curve import Drawing
from study.compare.report import describe_jump
from study.compare.result import ComparisonResult
from study.compare.section.section import Section
from study.page.table import Table

TEXT = (
    "Frequency and damping ratio of each mode at each level, read from the same points of the measured and of the "
    "predicted response by the parabola of one mode. With friction they change with the level: the backbone. Intervals "
    "are two standard deviations of the difference, by noise, friction histories, numerical error and the reading of "
    "the peak; a deviation above 4 is not due to chance."
)
HEAD = (
    "structure",
    "mode",
    "level",
    "sensor",
    "measured [Hz]",
    "model [Hz]",
    "error",
    "deviations",
    "measured ζ",
    "model ζ",
    "error",
    "deviations",
)


def make_resonance_sections(compared: ComparisonResult, drawing: Drawing) -> Iterator[Section]:
    """Section on resonances, if the bands contain one."""
    remarks = [f"Not read: {reason}." for reason in compared.unread]
    jumps = [describe_jump(jump, drawing.unit) for jump in compared.jumps]
    if jumps:
        remarks.append(f"Jumps: {'; '.join(jumps)}.")
    if not compared.peaks:
        if remarks:
            yield Section(title="Resonances and backbone", text=" ".join(remarks))
        return
    table = Table(head=HEAD, rows=[_format_row(peak, drawing) for peak in compared.peaks], words=4)
    plots = draw_backbones({"predicted": compared.peaks}, drawing.unit)
    yield Section(title="Resonances and backbone", text=" ".join([TEXT, *remarks]), table=table, plots=plots)


def _format_row(peak: PeakError, drawing: Drawing) -> list[str]:
    held = ", held out" if peak.level in drawing.held_out else ""
    frequency = _format_error(peak.predicted_frequency - peak.frequency, peak.frequency, peak.frequency_deviation, 3)
    damping = _format_error(peak.predicted_damping - peak.damping, peak.damping, peak.damping_deviation, 1)
    return [
        name_configuration(peak.free), str(peak.mode), f"{peak.level:g} {drawing.unit}{held}", peak.sensor,
        f"{peak.frequency:.3f}", _number(peak.predicted_frequency), *frequency, f"{100 * peak.damping:.3f} %",
        _number(100 * peak.predicted_damping, " %"), *damping,
    ]  # fmt: skip


def _number(value: float, unit: str = "") -> str:
    return f"{value:.3f}{unit}" if np.isfinite(value) else "none"


def _format_error(difference: float, value: float, deviation: float, digits: int) -> tuple[str, str]:
    if not np.isfinite(difference):
        return "", ""
    relative = f"{100 * difference / value:+.{digits}f} %"
    return relative, f"{difference / deviation:+.1f}" if np.isfinite(deviation) and deviation > 0 else ""
