"""Frequency and damping of each mode over the level, measured and predicted by models, as plotly figures."""

from collections.abc import Mapping, Sequence
from typing import Any

from correlation.campaign.measurement import name_configuration
from correlation.metric.peak_error import PeakError
from study.compare.sentence import group_modes, name_mode
from study.page.number import round_list

#: Line styles of models; a single model has the last one.
COLOURS, DASHES = ("#8a97a5", "#1f4e79", "#c2410c"), ("dot", "dash", "solid")


def draw_backbones(models: Mapping[str, Sequence[PeakError]], unit: str) -> list[dict[str, Any]]:
    """Draw a figure for each configuration and mode.

    Parameters
    ----------
    models
        Resonances by the name of the model, at most three; the measured ones are taken from the last model.
    unit
        Unit of the levels.
    """
    last = group_modes(list(models.values())[-1]) if models else {}
    everything = [peak for peaks in models.values() for peak in peaks]
    return [
        _draw(
            {name: group_modes(peaks).get(mode, []) for name, peaks in models.items()},
            f"{name_configuration(mode[0])}{name_mode(last.get(mode, every), everything)}",
            unit,
        )
        for mode, every in group_modes(everything).items()
    ]


def _draw(models: Mapping[str, Sequence[PeakError]], mode: str, unit: str) -> dict[str, Any]:
    traces: list[dict[str, Any]] = []
    styles = list(zip(COLOURS, DASHES, strict=True))[-len(models) :]
    for axis, scale, value in (("", 1.0, "frequency"), ("2", 100.0, "damping")):
        place = {"xaxis": f"x{axis}", "yaxis": f"y{axis}", "showlegend": not axis}
        for (name, peaks), (colour, dash) in zip(models.items(), styles, strict=True):
            predicted = [scale * getattr(peak, f"predicted_{value}") for peak in peaks]
            traces.append(
                {**place, "x": [peak.level for peak in peaks], "y": round_list(predicted, 7), "name": name,
                 "legendgroup": name, "mode": "lines+markers", "line": {"color": colour, "width": 2, "dash": dash},
                 "marker": {"size": 6}}
            )  # fmt: skip
        peaks = list(models.values())[-1]
        error = {
            "type": "data", "array": round_list([2 * scale * getattr(peak, f"{value}_deviation") for peak in peaks]),
            "thickness": 1.2, "width": 4, "color": "#18222d",
        }  # fmt: skip
        traces.append(
            {**place, "x": [peak.level for peak in peaks], "name": "measured", "legendgroup": "measured",
             "y": round_list([scale * getattr(peak, value) for peak in peaks], 7), "mode": "markers", "error_y": error,
             "marker": {"size": 8, "color": "white", "line": {"color": "#18222d", "width": 1.6}}}
        )  # fmt: skip
    layout = {
        "height": 330,
        "grid": {"rows": 1, "columns": 2, "pattern": "independent"},
        "xaxis": {"title": {"text": f"level [{unit}], {mode}"}, "rangemode": "tozero", "anchor": "y"},
        "xaxis2": {"title": {"text": f"level [{unit}], {mode}"}, "rangemode": "tozero", "anchor": "y2"},
        "yaxis": {"title": {"text": "frequency [Hz]", "standoff": 16}},
        "yaxis2": {"title": {"text": "damping ratio [%]", "standoff": 16}, "rangemode": "tozero"},
    }
    return {"data": traces, "layout": layout}
