"""``[[load_cells]]`` of a manifest: tangential and normal force of a contact line from a pair of load cells behind it.

The rotation of the two forces is that of `reduction.load_cell` (eqs 1 and 2 of the paper); it holds for each harmonic
and for the mean.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from correlation.campaign.measurement import CONTACT_FORCE, LOAD_CELL, MeasuredSensor, Measurement
from correlation.campaign.measurement_unit import read_si_quantity
from correlation.campaign.toml_table import TomlTable
from correlation.errors import CampaignError
from reduction.load_cell import compute_blade_contact, compute_decoupler_contact, contact_covariance, contact_jacobian

SIDES = ("de-coupler", "blade")
#: Columns of a table that identify a state and a harmonic.
STATE = ("test", "order", "repeat", "sweep", "level", "frequency", "harmonic")


@dataclass(frozen=True, kw_only=True)
class LoadCellPair:
    """Pair of load cells, and the contact forces that are computed from it.

    Parameters
    ----------
    cells
        Names of the sensors of R_3 and R_4.
    tangential, normal
        Names of the sensors of T and N, contact forces of one line.
    taper, arm
        Taper theta of the contact line and angle alpha of the arms [rad].
    dead_weight
        Weight that pulls the damper, for a line on the blade [N]; None for a line on the de-coupler.
    """

    cells: tuple[str, str]
    tangential: str
    normal: str
    taper: float
    arm: float
    dead_weight: float | None


def read_load_cells(table: TomlTable, sensors: Sequence[MeasuredSensor], names: Collection[str] | None) -> LoadCellPair:
    """Read one pair of load cells.

    Parameters
    ----------
    table
        Table of the pair.
    sensors
        Sensors of the manifest that have no mistake.
    names
        Names of all sensors; None if a sensor has no name, since any unknown name may be that of this sensor. The
        quantity of a sensor with a mistake is unknown and is not checked.

    Raises
    ------
    CampaignError
        A key or value cannot be used, a sensor is not a load cell or not a contact force, a load cell is not
        calibrated, or a sensor has no phase.
    """
    cells = [name for name in table.take("cells", list) if isinstance(name, str)]
    if len(cells) != 2 or cells[0] == cells[1]:
        raise table.problem("cells", "give the two load cells R_3 and R_4 by the names of their sensors")
    quantity = {sensor.name: sensor.component or sensor.quantity for sensor in sensors}
    named = {sensor.name: sensor for sensor in sensors}

    def is_unread(name: str) -> bool:
        return name not in named and (names is None or name in names)

    for name in cells:
        if is_unread(name):
            continue
        if quantity.get(name) != LOAD_CELL:
            raise table.problem("cells", f'"{name}" is not a [[sensor]] with quantity = "{LOAD_CELL}": add one')
        # Both forces are sums of the two readings, which need phases and known gains.
        if not (named[name].has_phase and named[name].calibrated):
            word = "calibrated" if named[name].has_phase else "phase"
            raise table.problem(
                "cells", f'sensor "{name}" has {word} = false: contact forces need complex readings in newtons'
            )
    forces = {}
    for component in ("tangential", "normal"):
        forces[component] = name = table.take(component, str)
        if is_unread(name):
            continue
        if quantity.get(name) != component:
            raise table.problem(
                component,
                f'is not a [[sensor]] with quantity = "{CONTACT_FORCE}" and component = "{component}": add one',
            )
        if not named[name].has_phase:
            raise table.problem(component, f'sensor "{name}" has phase = false: remove that, load cells give the phase')
    side = table.choice("side", SIDES) if "side" in table.values else SIDES[0]
    weight = (
        table.converted("dead_weight", lambda value: read_si_quantity(value, "N"), 0.0) if side == "blade" else None
    )
    if weight == 0.0:
        raise table.problem("dead_weight", "is needed for a line on the blade: give the force that pulls the damper")
    pair = LoadCellPair(
        cells=(cells[0], cells[1]),
        **forces,
        taper=table.converted("taper", lambda value: read_si_quantity(value, "rad"), example="8.53 deg"),
        arm=table.converted("arm", lambda value: read_si_quantity(value, "rad"), example="45 deg"),
        dead_weight=weight,
    )
    table.finish()
    return pair


def combine_load_cells(
    measurement: Measurement, sensors: Sequence[MeasuredSensor], pairs: Sequence[LoadCellPair]
) -> tuple[Measurement, tuple[MeasuredSensor, ...]]:
    """Replace the rows of load cells by rows of contact forces, and remove the load cells from the sensors.

    Parameters
    ----------
    measurement
        Rows; `sensor` is an index into `sensors`.
    sensors
        All sensors.
    pairs
        Pairs of load cells.

    Raises
    ------
    CampaignError
        A state was measured by only one cell of a pair.
    """
    names = [sensor.name for sensor in sensors]
    tables = [measurement.where(~np.isin(measurement.sensor, [names.index(name) for p in pairs for name in p.cells]))]
    for pair in pairs:
        first, second = (_sort_rows(measurement.where(measurement.sensor == names.index(name))) for name in pair.cells)
        if len(first) != len(second) or any(
            not np.array_equal(getattr(first, name), getattr(second, name)) for name in STATE
        ):
            raise CampaignError(
                f'load cells "{pair.cells[0]}" and "{pair.cells[1]}" were not read in the same states ({len(first)} '
                f"and {len(second)} rows): leave out what only one of them has"
            )
        line = compute_decoupler_contact(first.value, second.value, pair.taper, pair.arm)
        if pair.dead_weight is not None:
            line = compute_blade_contact(line, np.where(first.harmonic == 0, pair.dead_weight, 0.0), pair.taper)
        for name, value in ((pair.tangential, line.tangential), (pair.normal, line.normal)):
            columns = {**vars(first), "sensor": np.full(len(first), names.index(name)), "value": value}
            tables.append(Measurement(**columns))
    joined = Measurement(
        **{name: np.concatenate([getattr(table, name) for table in tables]) for name in vars(measurement)}
    )
    combined = {name for pair in pairs for name in pair.cells}
    left = [number for number, sensor in enumerate(sensors) if sensor.name not in combined]
    numbers = np.full(len(sensors), -1)
    numbers[left] = np.arange(len(left))
    columns = {**vars(joined), "sensor": numbers[joined.sensor]}
    stated = {name: sensor for pair in pairs for name, sensor in _add_stated_errors(pair, sensors).items()}
    return Measurement(**columns), tuple(stated.get(sensors[number].name, sensors[number]) for number in left)


def _add_stated_errors(pair: LoadCellPair, sensors: Sequence[MeasuredSensor]) -> dict[str, MeasuredSensor]:
    """Contact force sensors of a pair with the errors of its cells, unless they state their own.

    Absolute noise is propagated through the rotation. Relative noise and the uncertainty of gains are those of the
    worse cell.
    """
    named = {sensor.name: sensor for sensor in sensors}
    cells = [named[name] for name in pair.cells]
    jacobian = contact_jacobian(0.0, 0.0, pair.taper, pair.arm, pair.dead_weight)
    absolute = np.sqrt(np.diag(contact_covariance(jacobian, np.diag([cell.noise[1] ** 2 for cell in cells]))))
    result = {}
    for name, own in zip((pair.tangential, pair.normal), absolute.tolist(), strict=True):
        noise = (max(cell.noise[0] for cell in cells), own)
        gain = max(cell.uncertainty for cell in cells)
        known = named[name]
        result[name] = replace(
            known, noise=known.noise if any(known.noise) else noise, uncertainty=known.uncertainty or gain
        )
    return result


def _sort_rows(table: Measurement) -> Measurement:
    return table.where(np.lexsort([getattr(table, name) for name in STATE]))
