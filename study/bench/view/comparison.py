"""View of a comparison: measured families, predictions and residuals, map of the misfit, and verdict in words."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from correlation.campaign.measurement import Suspicion
from correlation.metric.misfit import summarise_misfit
from correlation.prediction import Points
from figure.style import choose_family_colours
from study.bench.line import Lines, at_measured
from study.compare.curve import Coefficients, Drawing, SensorPanel, find_rows, join_sides
from study.compare.result import ComparisonResult
from study.compare.section.misfit import make_misfit_sections
from study.compare.section.response import make_response_sections
from study.compare.sentence import Summary, summarise
from study.page.number import round_list

#: Significant digits of the lines, and of their slopes.
DIGITS, SLOPE_DIGITS = 6, 4


def show_comparison(compared: ComparisonResult, lines: Mapping[str, Lines]) -> dict[str, Any]:
    """Make the parts "verdict", "responses" and "map" of the page.

    Parameters
    ----------
    compared
        Comparison at the values of the case file.
    lines
        Lines with slopes, by configuration.
    """
    points = {free: (item.points, item.prediction.value) for free, item in _split_by_free(lines).items()}
    drawing = Drawing.of(compared, points)
    (responses,), (misfit,) = make_response_sections(compared, drawing), make_misfit_sections(compared, drawing)
    data = {**responses.data, "dark_colours": choose_family_colours(len(responses.data["levels"]), dark=True)}
    panels = [panel for listed in drawing.panels.values() for panel in listed if panel.curves]
    free_of = [free for free, listed in drawing.panels.items() for panel in listed if panel.curves]
    for shown, panel, free in zip(data["panels"], panels, free_of, strict=True):
        shown["sensor"] = panel.key[0]
        for group, curve in zip(shown["groups"], _show_lines(panel, _split_by_free(lines)[free]), strict=True):
            group |= curve
    return {
        "verdict": show_summary(compared.title, compared.campaign.title, summarise(compared), compared.suspicions),
        "responses": data,
        "map": dict(misfit.data),
    }


def show_summary(title: str, campaign: str, summary: Summary, suspicions: Sequence[Suspicion]) -> dict[str, Any]:
    """Make the view of the verdict, with the titles of case and campaign, and suspicious measurements."""
    return {
        "title": title,
        "campaign": campaign,
        "tone": summary.tone,
        "tag": summary.tag,
        "sentences": list(summary.sentences),
        "cards": [list(card) for card in summary.cards],
        "suspicions": [{"where": item.where, "sentence": item.sentence} for item in suspicions],
    }


def show_moved(
    compared: ComparisonResult, lines: Mapping[bool, tuple[Points, Coefficients]]
) -> tuple[dict[str, Any], dict[str, float]]:
    """Make the view of exact lines at other values of the parameters, in the order of the panels, and their errors."""
    drawing = Drawing.of(compared, lines)
    panels = [panel for listed in drawing.panels.values() for panel in listed if panel.curves]
    shown = [[_split_complex(curve.line) for curve in panel.curves] for panel in panels]
    return {"panels": shown}, list_errors(compared, lines)


def list_errors(compared: ComparisonResult, lines: Mapping[bool, tuple[Points, Coefficients]]) -> dict[str, float]:
    """List the median errors of amplitude [%] and phase [deg] of lines, over training and held-out data together."""
    misfit, _ = join_sides(compared.train, compared.held_out)
    for points, line in lines.values():
        misfit = at_measured(misfit, points, line)
    summary = summarise_misfit(misfit)
    return {
        "median error of the amplitude [%]": 100 * summary.amplitude_error,
        "median error of the phase [deg]": float(np.degrees(summary.phase_error)),
    }


def _split_by_free(lines: Mapping[str, Lines]) -> dict[bool, Lines]:
    return {name == "free": item for name, item in lines.items()}


def _show_lines(panel: SensorPanel, lines: Lines) -> list[dict[str, Any]]:
    """Make the line and slopes of each curve of a panel, in the unit of the panel."""
    points, result = lines.points, []
    for curve in panel.curves:
        rows = find_rows(points, *panel.key, curve.level)
        rows = rows[points.sweep[rows] == curve.sweep]
        slopes = panel.factor(points.force[rows])[:, None] * lines.slopes[rows]
        result.append(
            {"value": _split_complex(curve.line), "slopes": [_split_complex(slope, SLOPE_DIGITS) for slope in slopes.T]}
        )
    return result


def _split_complex(values: Coefficients, digits: int = DIGITS) -> list[list[float | None]]:
    """Split into rounded real and imaginary parts."""
    return [round_list(values.real, digits), round_list(values.imag, digits)]
