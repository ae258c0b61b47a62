"""Curves and limits over parameters as netCDF and CSV."""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.limits.result import SIDES
from study.limits.result import LimitCurves
from study.limits.several.quantity import Quantity
from study.solve.result import DISPLAY_UNIT, SI_UNIT
from study.sweep.parameter import CaseParameter
from study.sweep.samples import SampledCurves

if TYPE_CHECKING:
    import xarray as xr

Real = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledLimits:
    """Limits of one quantity at n points.

    Parameters
    ----------
    quantity
        Bounded quantity.
    points
        Limits at each point.
    """

    quantity: Quantity
    points: tuple[LimitCurves, ...]

    @property
    def first(self) -> LimitCurves:
        """Limits of the first point; quantity, unit, levels and frequencies are the same at all points."""
        return self.points[0]

    def peaks(self) -> Float[Real, "n 2 level 2"]:
        """Value and frequency [Hz] of the highest points of both limits, the lower limit first; NaN if not found."""
        peaks = np.full((len(self.points), 2, len(self.first.limits.level), 2), np.nan)
        for point, side, level in np.ndindex(*peaks.shape[:3]):
            own = self.points[point]
            at = own.extreme(side, level)
            if at is not None:
                peaks[point, side, level] = own.value[side, level, at], own.limits.frequency[at]
        return peaks


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledCase:
    """Results of a case at n points of its parameters.

    Parameters
    ----------
    parameters
        The d parameters.
    values
        Values at each point, in the units of the parameters, shape (n, d).
    curves
        Response curves; None for a case without a [sweep].
    limits
        Limits of each quantity at all points; empty if they were not requested.
    """

    parameters: tuple[CaseParameter, ...]
    values: Float[Real, "n d"]
    curves: SampledCurves | None
    limits: tuple[SampledLimits, ...] = ()

    def curve_quantities(self) -> Float[Real, "n curve output 4"]:
        """Position of the peak [Hz or -], amplitude [SI], damping ratio, and 1 for a peak at an end of its curve."""
        assert self.curves is not None
        outputs = range(len(self.curves.model.outputs))
        rows = [[[item.peak(output) for output in outputs] for item in point] for point in self.curves.curves]
        return np.array(
            [
                [[(peak.parameter, peak.amplitude, peak.damping, peak.at_end) for peak in curve] for curve in point]
                for point in rows
            ],
            dtype=np.float64,
        )


def format_curves_csv(sampled: SampledCase) -> str:
    """Format one line per point of each curve."""
    curves = sampled.curves
    assert curves is not None
    head = [*_list_parameter_columns(sampled), "curve", "frequency [Hz]", "level"]
    for output in curves.model.outputs:
        head += [f"{output.name} amplitude [{DISPLAY_UNIT[output.quantity][0]}]", f"{output.name} phase [deg]"]
    head.append("truncation error")

    def lines() -> Iterable[list[object]]:
        for values, point in zip(sampled.values, curves.curves, strict=True):
            for item in point:
                columns = [item.frequency, item.level]
                for output, response in zip(curves.model.outputs, item.response, strict=True):
                    columns += [DISPLAY_UNIT[output.quantity][1] * np.abs(response), np.degrees(np.angle(response))]
                columns.append(item.truncation_error)
                for row in zip(*columns, strict=True):
                    yield [*_format_numbers(values), item.curve.label, *_format_numbers(row)]

    return write_csv(head, lines())


def format_peaks_csv(sampled: SampledCase) -> str:
    """Format one line per point and curve: peak and equivalent damping of each output."""
    curves = sampled.curves
    assert curves is not None
    place = "frequency [Hz]" if curves.model.curves[0].parameter == "frequency" else "level"
    head = [*_list_parameter_columns(sampled), "curve"]
    for output in curves.model.outputs:
        unit = DISPLAY_UNIT[output.quantity][0]
        head += [f"{output.name} peak {place}", f"{output.name} peak amplitude [{unit}]"]
        head += [f"{output.name} equivalent damping ratio", f"{output.name} peak at the end"]
    quantities = sampled.curve_quantities()

    def lines() -> Iterable[list[object]]:
        for number, (values, point) in enumerate(zip(sampled.values, curves.curves, strict=True)):
            for curve, item in enumerate(point):
                cells: list[str] = []
                for output, sensor in enumerate(curves.model.outputs):
                    along, amplitude, damping, at_end = quantities[number, curve, output]
                    scaled = DISPLAY_UNIT[sensor.quantity][1] * amplitude
                    cells += _format_numbers((along, scaled, damping, at_end))
                yield [*_format_numbers(values), item.curve.label, *cells, item.stop_message]

    return write_csv([*head, "end of the curve"], lines())


def format_limits_csv(sampled: SampledCase) -> str:
    """Format one line per quantity, point, level and frequency, with both limits."""
    head = ["quantity", "unit", *_list_parameter_columns(sampled), "level", "frequency [Hz]", *SIDES]

    def lines() -> Iterable[list[object]]:
        for item in sampled.limits:
            for values, own in zip(sampled.values, item.points, strict=True):
                for level, at in np.ndindex(own.value.shape[1:]):
                    row = (own.limits.level[level], own.limits.frequency[at], *own.value[:, level, at])
                    yield [own.quantity, own.unit, *_format_numbers(values), *_format_numbers(row)]

    return write_csv(head, lines())


def make_dataset(sampled: SampledCase, title: str) -> "xr.Dataset":
    """Make a dataset of all results; each point of a curve has the numbers of its parameter point and its curve."""
    import xarray as xr

    data = xr.Dataset(
        {"value": (("sample", "parameter"), sampled.values, {"long_name": "value of each parameter in its unit"})},
        coords={
            "parameter": np.array([item.name for item in sampled.parameters], dtype=object),
            "parameter_unit": ("parameter", np.array([item.unit or "1" for item in sampled.parameters], dtype=object)),
        },
        attrs={"title": title},
    )
    if sampled.curves is not None:
        data = data.merge(_make_curve_data(sampled, sampled.curves), combine_attrs="override")
    if sampled.limits:
        peaks, along = np.array([item.peaks() for item in sampled.limits]), ("limit_quantity", "sample", "side")
        values = np.array([[own.value for own in item.points] for item in sampled.limits])
        first, unit = sampled.limits[0].first.limits, {"units": "see limit_unit"}
        data = data.assign(
            limit=((*along, "limit_level", "limit_frequency"), values, unit),
            limit_peak=((*along, "limit_level"), peaks[..., 0], unit),
            limit_peak_frequency=((*along, "limit_level"), peaks[..., 1], {"units": "Hz"}),
        ).assign_coords(
            limit_quantity=np.array([item.first.quantity for item in sampled.limits], dtype=object),
            limit_unit=("limit_quantity", np.array([item.first.unit for item in sampled.limits], dtype=object)),
            side=np.array(SIDES, dtype=object),
            limit_level=first.level,
            limit_frequency=("limit_frequency", first.frequency, {"units": "Hz"}),
        )
    return data


def _make_curve_data(sampled: SampledCase, curves: SampledCurves) -> "xr.Dataset":
    import xarray as xr

    flat = [(number, place, item) for number, point in enumerate(curves.curves) for place, item in enumerate(point)]
    counts = [len(item.frequency) for _, _, item in flat]
    quantities = sampled.curve_quantities()
    outputs, peaks = curves.model.outputs, ("sample", "curve_number", "output")
    response = np.concatenate([item.response for _, _, item in flat], axis=1)
    over_frequency = curves.model.curves[0].parameter == "frequency"
    return xr.Dataset(
        {
            "frequency": ("point", np.concatenate([item.frequency for _, _, item in flat]), {"units": "Hz"}),
            "level": ("point", np.concatenate([item.level for _, _, item in flat]), {"units": "1"}),
            "sample_of_point": ("point", np.repeat([number for number, _, _ in flat], counts)),
            "curve_of_point": ("point", np.repeat([place for _, place, _ in flat], counts)),
            "response_real": (("output", "point"), response.real, {"units": "SI, see output_unit"}),
            "response_imag": (("output", "point"), response.imag, {"units": "SI, see output_unit"}),
            "truncation_error": ("point", np.concatenate([item.truncation_error for _, _, item in flat])),
            "peak": (peaks, quantities[..., 0], {"units": "Hz" if over_frequency else "1"}),
            "peak_amplitude": (peaks, quantities[..., 1], {"units": "SI, see output_unit"}),
            "equivalent_damping": (peaks, quantities[..., 2], {"units": "1"}),
            "peak_at_end": (peaks, quantities[..., 3] == 1),
        },
        coords={
            "curve_label": ("curve_number", np.array([item.label for item in curves.model.curves], dtype=object)),
            "output": np.array([item.name for item in outputs], dtype=object),
            "output_unit": ("output", np.array([SI_UNIT[item.quantity] for item in outputs], dtype=object)),
        },
    )


def write_csv(head: Sequence[str], lines: Iterable[Sequence[object]]) -> str:
    """Format a table as CSV."""
    stream = io.StringIO()
    write = csv.writer(stream, lineterminator="\n").writerow
    write(head)
    for line in lines:
        write(line)
    return stream.getvalue()


def _list_parameter_columns(sampled: SampledCase) -> list[str]:
    return [item.label for item in sampled.parameters]


def _format_numbers(values: Iterable[float]) -> list[str]:
    return [f"{value:.10g}" for value in values]
