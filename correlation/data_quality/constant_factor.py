r"""Channels with a well-known constant factor at all points: g for m/s^2, inches, rms for peak.

The ratio of a reading to the model, :math:`r = \ln |X_m / X_p|`, is that of a wrong unit at every frequency and level,
at a resonance too after subtraction of the part common to all channels of a state. An error of the model causes another
factor, factors that vary over frequency and level, or factors of the other channels too. Powers of ten are handled by
`wrong_unit`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_quality.logarithm import wrap_phases
from correlation.data_quality.model_ratio import find_model_ratios
from correlation.prediction import Points
from correlation.row_group import group_medians, group_rows

#: Least ratio of the error of one channel to the misfit of the model at the others; tolerances for a known factor, as a
#: multiple of that misfit and as a fraction of its logarithm [-].
BESIDE, WITHIN, NEAR = 4.0, 3.0, 1 / 8
#: Tolerance within which a factor of amplitudes, or a common one of all channels, differs from a model error [-]: the
#: readings of a channel have it within their scatter, and a model with an error of 40 % hardly does.
FACTOR_TOLERANCE = 0.01
#: Least number of points of a channel for a factor, and largest phase difference from the other channels [rad].
FEWEST, PHASE = 5, 0.2
INCH, G = 0.0254, 9.80665
#: Actual unit of the values and unit in the manifest, by the factor between them.
UNITS = {
    quantity: {1 / INCH: (f"inch{per}", f"m{per}"), INCH: (f"m{per}", f"inch{per}"),
               INCH / 1e-3: (f"mm{per}", f"inch{per}"), 1e-3 / INCH: (f"inch{per}", f"mm{per}"), **more}
    for quantity, per, more in (
        ("displacement", "", {}), ("velocity", "/s", {}),
        ("acceleration", "/s^2", {G: ("m/s^2", "g_n"), 1 / G: ("g_n", "m/s^2")}),
    )
}  # fmt: skip
AMPLITUDES = {
    2**-0.5: ("rms", "peak"), 2**0.5: ("peak", "rms"), 2.0: ("peak to peak", "peak"), 0.5: ("peak", "peak to peak"),
    8**-0.5: ("rms", "peak to peak"), 8**0.5: ("peak to peak", "rms"),
}  # fmt: skip

Ratios = Float[NDArray[np.float64], " n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Readings:
    """Fundamentals of calibrated motions: sensor, run (test and level), state, and ln (measured / model)."""

    sensor: Int[NDArray[np.int64], " n"]
    run: Int[NDArray[np.int64], " n"]
    state: Int[NDArray[np.int64], " n"]
    ratio: Complex[NDArray[np.complex128], " n"]


def find_constant_factors(
    campaign: Campaign, points: Points, predicted: Complex[NDArray[np.complex128], " k"]
) -> tuple[Suspicion, ...]:
    """Channels whose readings have the factor of a wrong unit or kind of amplitude: all of them, or single ones.

    Parameters
    ----------
    campaign
        Campaign.
    points, predicted
        Points and the prediction of the model there, shape (k,).
    """
    readings = _read(campaign, points, predicted)
    sensors = np.unique(readings.sensor).tolist()
    if len(sensors) < 2:
        return ()
    return tuple(_find_common_factor(campaign, readings, sensors)) or tuple(
        _find_channel_factor(campaign, readings, sensors)
    )


def _read(campaign: Campaign, points: Points, predicted: Complex[NDArray[np.complex128], " k"]) -> _Readings:
    table, ratio = find_model_ratios(campaign, points, predicted)
    moves = np.array([item.quantity in UNITS and item.calibrated for item in campaign.sensors])[table.sensor]
    table = table.where(moves)
    run = [table.test, table.level]
    return _Readings(
        sensor=table.sensor,
        run=group_rows(run).number,
        state=group_rows([*run, table.repeat, table.sweep, table.frequency]).number,
        ratio=np.log(ratio[moves]),
    )


def _find_common_factor(campaign: Campaign, readings: _Readings, sensors: list[int]) -> Iterator[Suspicion]:
    """Common factor of all channels, accurate enough to be a factor of the load."""
    quantities = {campaign.sensors[item].quantity for item in sensors}
    factors = [_find_constant_ratio(readings, readings.sensor == item, readings.ratio.real) for item in sensors]
    known = {**AMPLITUDES, **(UNITS[next(iter(quantities))] if len(quantities) == 1 else {})}
    factor = _find_nearest(known, float(np.median(factors)))
    miss = float(np.abs(np.array(factors) - np.log(factor)).max())
    if miss < FACTOR_TOLERANCE:
        true, read = known[factor]
        asked, correction = _format_question(true, read, "their"), "correct the column unit"
        if factor in AMPLITUDES:  # convention.amplitude also applies to the force, which keeps their ratio
            asked = f"are the responses {true} values, and the forces {read}?"
            correction = "convert one of them, and state the common convention in convention.amplitude"
        yield Suspicion(
            where="all sensors",
            sentence=f"each reads {np.exp(np.median(factors)):.3g} times what the model says, at all levels and "
            f"frequencies: {asked} If so, {correction}; if not, the load of the case",
            remark=True,
        )


def _find_channel_factor(campaign: Campaign, readings: _Readings, sensors: list[int]) -> Iterator[Suspicion]:
    """Factor of one channel alone, if the others agree with the model."""
    for sensor in sensors:
        apart = _compute_ratios_to_others(readings, sensor)
        if campaign.sensors[sensor].has_phase and not np.nanmedian(np.abs(apart.imag)) < PHASE:
            continue
        factor = _find_constant_ratio(readings, np.isfinite(apart), apart.real)
        size = np.abs(readings.ratio.real)
        fit = max(float(np.median(size[readings.sensor == item])) for item in sensors if item != sensor)
        units = UNITS[campaign.sensors[sensor].quantity]
        nearest = _find_nearest({**units, **AMPLITUDES}, factor)
        known = abs(np.log(nearest))
        close = min(max(WITHIN * fit, FACTOR_TOLERANCE), NEAR * known) if nearest in units else FACTOR_TOLERANCE
        if known > BESIDE * fit and abs(factor - np.log(nearest)) < close:
            ten = np.log(10) * np.sign(factor)
            alike = (
                " A range or gain that is wrong by a factor of ten looks the same." if abs(factor - ten) < close else ""
            )
            yield Suspicion(
                where=f'sensor "{campaign.sensors[sensor].name}"',
                sentence=f"it reads {np.exp(factor):.3g} times what the model says, at all levels and frequencies, and "
                f"the model is off by up to {np.expm1(fit):.1%} at the other sensors (medians): "
                f"{_format_question(*{**units, **AMPLITUDES}[nearest], 'its')} If so, correct its "
                f"{'unit' if nearest in units else 'columns'}.{alike}".removesuffix("."),
                remark=nearest not in units,
            )


def _compute_ratios_to_others(readings: _Readings, sensor: int) -> Complex[NDArray[np.complex128], " n"]:
    """Ratios of one channel relative to the medians of the others in the same states; NaN in all other rows."""
    own = readings.sensor == sensor
    state, number = np.unique(readings.state[~own], return_inverse=True)
    usual = np.full(readings.state.max() + 1, np.nan, dtype=np.complex128)
    parts = (group_medians(number, part[~own]) for part in (readings.ratio.real, readings.ratio.imag))
    usual[state] = next(parts) + 1j * next(parts)
    return wrap_phases(np.where(own, readings.ratio - usual[readings.state], np.nan))


def _find_constant_ratio(readings: _Readings, rows: Bool[NDArray[np.bool_], " n"], ratio: Ratios) -> float:
    """Median of ratios, if it applies to every run and to most points; else NaN."""
    values = ratio[rows]
    if len(values) < FEWEST:
        return np.nan
    middle = float(np.median(values))
    runs = group_medians(np.unique(readings.run[rows], return_inverse=True)[1], values)
    apart = max(float(np.abs(runs - middle).max()), float(np.median(np.abs(values - middle))))
    return middle if apart < max(2 * FACTOR_TOLERANCE, NEAR * abs(middle)) else np.nan


def _find_nearest(known: Mapping[float, tuple[str, str]], factor: float) -> float:
    """Known factor nearest to the factor with a given logarithm."""
    return min(known, key=lambda item: abs(np.log(item) - factor))


def _format_question(true: str, read: str, whose: str) -> str:
    return f"are {whose} values {true}, and read as {read}?"
