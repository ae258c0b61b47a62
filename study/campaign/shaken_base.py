"""Columns of a vibration controller, which controls the acceleration of a shaken base by a voltage."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from study.campaign.column_role import Recognised, Role, name_words
from study.campaign.table import MeasuredTable

CONTROL_WORDS, DEMAND_WORDS = {"control", "regelsignal"}, {"demand", "target", "sollwert", "profile"}


def recognise_controller(table: MeasuredTable, columns: Mapping[str, Recognised]) -> dict[str, Recognised]:
    """Recognise the acceleration "control" as the drive, if the table has a demand or a voltage; else no change.

    Parameters
    ----------
    table
        Table.
    columns
        Judgement on each column.
    """
    words = {one.name: set(name_words(table.short_name(one))) for one in table.columns}
    of_motion = [one for one in table.columns if columns[one.name].quantity == "acceleration"]
    control = next((one for one in of_motion if words[one.name] & CONTROL_WORDS), None)
    demands = [one for one in of_motion if words[one.name] & DEMAND_WORDS]
    drives = [one for one in table.columns if columns[one.name].role is Role.FORCE and one is not control]
    voltages = [one for one in drives if columns[one.name].quantity == "voltage"]
    if control is None or not (demands or voltages) or len(voltages) < len(drives):
        return dict(columns)
    why = f'called "{control.name}" next to "{(demands or voltages)[0].name}": the controlled acceleration of the base'
    result = {**columns, control.name: replace(columns[control.name], role=Role.FORCE, evidence=why)}
    for one in demands:
        is_level = len(np.unique(one.values)) == 1
        role, why = (Role.LEVEL, "the demand of the controller") if is_level else (Role.OTHER, "a demand that varies")
        result[one.name] = replace(columns[one.name], role=role, evidence=why)
    for one in voltages:
        result[one.name] = replace(
            columns[one.name], role=Role.OTHER, evidence="the output of the controller to its shaker"
        )
    return result
