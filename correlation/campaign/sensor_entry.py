"""``[[sensor]]`` of a manifest: quantity, position, axis and properties of the readings of a sensor."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.campaign.measurement import COMPONENTS, CONTACT_FORCE, LOAD_CELL, SI_UNIT, MeasuredSensor
from correlation.campaign.measurement_unit import read_si_quantity
from correlation.campaign.toml_table import TomlTable

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
#: Largest inclination of a sensor against its direction [rad]; above it, another direction is to be given.
MOST_INCLINED = math.radians(80)


def read_sensor(table: TomlTable) -> MeasuredSensor:
    """Read one sensor.

    Raises
    ------
    CampaignError
        A key or a value cannot be used.
    """
    quantity = table.choice("quantity", SI_UNIT)
    common: dict[str, Any] = {
        "name": table.take("name", str),
        "quantity": quantity,
        **_read_properties(table, quantity),
    }
    if quantity == CONTACT_FORCE:
        sensor = MeasuredSensor(**common, line=table.take("line", str), component=table.choice("component", COMPONENTS))
    elif quantity == LOAD_CELL:
        sensor = MeasuredSensor(**common, cell=table.take("cell", str, None))
    else:
        sensor = MeasuredSensor(**common, **_position(table))
    # The unit of the absolute noise depends on the direction: metres or radians.
    noise = table.converted("noise", lambda value: _read_noise(value, sensor), (0.0, 0.0))
    table.finish()
    return MeasuredSensor(**{**vars(sensor), "noise": noise})


def _read_properties(table: TomlTable, quantity: str) -> dict[str, Any]:
    """Read the properties of the readings: uncertainty of the gain, calibration, unit, phase."""
    uncertainty = table.converted("uncertainty", lambda value: read_si_quantity(value, ""), 0.0)
    if uncertainty < 0:
        raise table.problem("uncertainty", "must not be negative")
    calibrated = table.take("calibrated", bool, True)
    if calibrated and "reading_unit" in table.values:
        raise table.problem("reading_unit", f"needs calibrated = false: a {quantity} is in SI")
    return {
        "uncertainty": uncertainty,
        "calibrated": calibrated,
        "reading_unit": table.take("reading_unit", str, "" if calibrated else "V"),
        "has_phase": table.take("phase", bool, True),
    }


def _position(table: TomlTable) -> dict[str, Any]:
    """Read the position and axis of a motion sensor; they may be missing for a sensor of the case."""
    place, point = table.take("place", str, None), table.take("coordinates", list, None)
    if place is not None and point is not None:
        wanted = 'give place = "..." or coordinates = ["500 mm", "0 mm", "0 mm"], one of them'
        raise table.problem("place", wanted, show=False)
    if point is not None and len(point) != 3:
        raise table.problem("coordinates", 'give three, e.g. ["500 mm", "0 mm", "0 mm"]')
    # Without a position or axis, the axis is that of the sensor of this name in the case.
    has_axis = point is not None or not table.values.keys().isdisjoint({"direction", "inclination"})
    direction = table.choice("direction", DIRECTIONS) if has_axis else table.take("direction", str, "")
    inclination = table.converted("inclination", lambda value: read_si_quantity(value, "rad"), 0.0)
    toward = ""
    if inclination:
        toward = table.choice("toward", tuple(axis for axis in DIRECTIONS[:3] if axis != direction))
        if not 0 < inclination <= MOST_INCLINED:
            raise table.problem("inclination", 'give an angle above 0 and up to "80 deg", and change direction instead')
    elif "toward" in table.values:
        raise table.problem("toward", 'needs an inclination such as "3 deg": add it, or remove toward')
    return {
        "direction": direction,
        "place": place,
        "coordinates": point and table.converted("coordinates", _point),
        "relative_to": table.take("relative_to", str, None),
        "inclination": inclination,
        "toward": toward,
    }


def _point(values: object) -> NDArray[np.float64]:
    return np.array([read_si_quantity(value, "m") for value in values]) if isinstance(values, list) else np.zeros(0)


def _read_noise(value: object, sensor: MeasuredSensor) -> tuple[float, float]:
    """Relative [-] and absolute [unit of the sensor] noise; several values of one kind are added in quadrature."""
    parts = value if isinstance(value, list) else [value]
    relative = absolute = 0.0
    for part in parts:
        text = str(part)
        if text.strip().endswith("%") or isinstance(part, int | float):
            relative = math.hypot(relative, read_si_quantity(part, ""))
        elif sensor.calibrated:
            absolute = math.hypot(absolute, read_si_quantity(part, sensor.unit))
        else:
            raise ValueError('give a share such as "1 %": the sensor is not calibrated')
    if min(relative, absolute) < 0 or not relative + absolute > 0 or relative >= 1:
        raise ValueError(f'give a standard deviation above zero, e.g. "0.5 %" or ["0.5 %", "0.1 {sensor.unit}"]')
    return relative, absolute
