r"""Frequency responses that differ from a model by a constant factor: millimetres for metres, g for m/s^2.

The residue of a mode, :math:`\phi_c \phi_f / 2 i \omega`, does not depend on its damping and little on its frequency.
If the ratios of measured residues to those of the model are the same for all modes and sensors, the unit is wrong; if
they are proportional to a power of :math:`i \omega`, the quantity is.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.campaign.measurement import ROTATION_UNIT, SI_UNIT, Suspicion
from correlation.data_quality.size_cause import list_causes
from correlation.data_quality.wrong_unit import format_times
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.mode import compute_linear_modes, find_partner, list_motion_sensors
from correlation.data_type.mode_set import correct_modes
from correlation.model import DERIVATIVE, Model
from geometry.plain_number import format_number


class _ClearFactor(NamedTuple):
    """Conditions for a common factor of measured to predicted residues that is not an error of the model."""

    n_ratio: int
    """Least number of ratios [-]."""
    least: float
    """Least median of the ratios [-]."""
    spreads: float
    """Least ratio of the logarithm of the median to the spread: `MIN_SHARE_WITHIN_SPREAD` are within the spread [-]."""


#: Of 20,000 random chains of up to six masses, with individual and common errors of masses and springs of 2 to 40 %,
#: 0.04, 0.4 and 0.7 % of those with 5 ratios, 3 and fewer pass; with errors of up to 20 %, 0, 0.04 and 0.1 % do.
CLEAR_FACTORS = (_ClearFactor(5, 1.25, 8.0), _ClearFactor(3, 3.0, 3.0), _ClearFactor(1, 10.0, 2.0))
#: Fraction of the ratios within their spread [-].
MIN_SHARE_WITHIN_SPREAD = 0.9
#: Least motion of a sensor in a mode of the model, relative to the largest one, for the sensor to show the mode [-].
MOVES = 0.1
#: A power of the frequency explains ratios if they are closer to it than to a constant by this factor [-], and if they
#: differ from a power of ten by at most this factor [natural logarithm].
MIN_POWER_ADVANTAGE, MAX_FACTOR_LEFT = 3.0, 0.3


class _Ratios(NamedTuple):
    """Ratios of measured residues to those of the model, one for each sensor and mode: shape (k,) each."""

    sensor: Int[NDArray[np.int64], " k"]
    omega: Float[NDArray[np.float64], " k"]
    logarithm: Complex[NDArray[np.complex128], " k"]

    def select_sensor(self, sensor: int) -> "_Ratios":
        return _Ratios(*(item[self.sensor == sensor] for item in self))


def find_wrong_size(model: Model, response: MeasuredResponse) -> Iterator[Suspicion]:
    """The common factor of all sensors of a response relative to the model, otherwise that of single sensors.

    Parameters
    ----------
    model
        Model with the sensors of the campaign.
    response
        Measured responses with their modes.

    Raises
    ------
    CampaignError
        The model has no motion sensor with the name of a sensor of the response.
    """
    ratios = _read_ratios(model, response)
    sensors = list_motion_sensors(model, response.sensors)
    quantities = [sensor.quantity for sensor in sensors]
    if (power := _find_power(ratios, quantities)) and len(set(quantities)) == 1:
        yield _suspect_quantity(response, quantities[0], power, ratios)
    elif _is_clear(ratios.logarithm.real):
        yield _suspect_size(response.name, "its responses are", ratios, quantities)
    else:
        for row, name in enumerate(response.sensors):
            own = ratios.select_sensor(row)
            if len(own.sensor) and abs(np.median(own.logarithm.real)) > np.log(CLEAR_FACTORS[-1].least):
                yield _suspect_size(f'{response.name}, "{name}"', "its response is", own, quantities[row : row + 1])


def _read_ratios(model: Model, response: MeasuredResponse) -> _Ratios:
    frequency, _, shapes = compute_linear_modes(model, response.configuration)
    system = model.in_configuration(response.configuration).system
    sensors = list_motion_sensors(model, response.sensors)
    rows = np.array([sensor.gain * sensor.row for sensor in sensors])
    # The gain of a sensor or drive in volts or percent is unknown, so that any factor is possible.
    calibrated = np.array(
        [
            unit.partition(" per ")[0] in {SI_UNIT[sensor.quantity], ROTATION_UNIT[sensor.quantity]}
            and unit.partition(" per ")[2] in {"N", "m/s^2"}
            for sensor, unit in zip(sensors, response.units, strict=True)
        ]
    )
    result: list[tuple[int, float, complex]] = []
    fit = response.fit
    for mode in correct_modes(model, response.modes) if fit is not None else ():
        partner = find_partner(model, mode, frequency, shapes)
        if fit is None or partner is None or not frequency[partner] > 0:
            continue
        measured = fit.residues[:, int(np.argmin(np.abs(fit.frequency - mode.frequency)))]
        omega, shape = 2 * np.pi * float(frequency[partner]), shapes[:, partner]
        of_model = (rows @ shape) * complex(shape @ system.dynamic[1]) / (2j * omega)
        tells = (np.abs(of_model) > MOVES * np.abs(of_model).max()) & (measured != 0) & calibrated
        result += [
            (row, omega, complex(np.log(measured[row] / of_model[row]))) for row in np.flatnonzero(tells).tolist()
        ]
    sensor, omegas, logarithm = zip(*result, strict=True) if result else ((), (), ())
    return _Ratios(np.array(sensor, dtype=np.int64), np.array(omegas, dtype=float), np.array(logarithm, dtype=complex))


def _spread(values: Float[NDArray[np.float64], " k"]) -> float:
    return float(np.quantile(np.abs(values - np.median(values)), MIN_SHARE_WITHIN_SPREAD))


def _is_clear(values: Float[NDArray[np.float64], " k"]) -> bool:
    """Whether logarithms of ratios have a common factor larger than an error of a model."""
    size = abs(float(np.median(values))) if len(values) else 0.0
    return any(
        len(values) >= item.n_ratio and size > max(np.log(item.least), item.spreads * _spread(values))
        for item in CLEAR_FACTORS
    )


def _find_power(ratios: _Ratios, quantities: list[str]) -> int:
    """Power of i omega that explains the ratios, by undeclared time derivatives; 0 for none."""
    values, logarithm = ratios.logarithm.real, np.log(ratios.omega)
    if len(values) < CLEAR_FACTORS[1].n_ratio or not np.ptp(logarithm) > np.log(CLEAR_FACTORS[0].least):
        return 0
    stated = DERIVATIVE[quantities[0]]
    quarter = ratios.logarithm.imag / (np.pi / 2)
    for power in {derivative - stated for derivative in DERIVATIVE.values()} - {0}:
        left = values - power * logarithm
        middle = float(np.median(left))
        ten = np.log(10) * round(middle / np.log(10))
        turned = np.abs((quarter - power + 1) % 2 - 1)  # up to the sign of a sensor
        if (
            MIN_POWER_ADVANTAGE * _spread(left) < _spread(values)
            and abs(middle - ten) + _spread(left) < MAX_FACTOR_LEFT
            and np.median(turned) < 1 / 3
        ):  # fmt: skip
            return power
    return 0


def _suspect_quantity(response: MeasuredResponse, stated: str, power: int, ratios: _Ratios) -> Suspicion:
    true = next(name for name, derivative in DERIVATIVE.items() if derivative == DERIVATIVE[stated] + power)
    ten = round(float(np.median(ratios.logarithm.real - power * np.log(ratios.omega))) / np.log(10))
    also = f" that is {format_times(ten)} as large" if ten else ""
    return Suspicion(
        where=response.name,
        sentence=f"the ratio of the residues of its modes to those of the model varies with omega^{power} and has a "
        f"phase of {90 * power:+d} deg: are these numbers a {true}{also}, declared as {stated}? If so, correct the "
        "quantity of the sensors",
    )


def _suspect_size(where: str, what: str, ratios: _Ratios, quantities: list[str]) -> Suspicion:
    middle = float(np.median(ratios.logarithm.real))
    count = len(np.unique(ratios.omega))
    within = (
        f", within {format_number(100 * np.expm1(_spread(ratios.logarithm.real)))} %" if len(ratios.omega) > 1 else ""
    )
    return Suspicion(
        where=where,
        sentence=f"{what} {format_times(middle / np.log(10))} those of the model, by the residues of {count} "
        f"mode{'s' if count > 1 else ''}{within}: "
        f"{list_causes(middle, _spread(ratios.logarithm.real), set(quantities))}",
    )
