"""The sensors of a campaign on a model: by name, by the place that they name, or by their coordinates."""

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from math import cos, sin

import numpy as np

from correlation.campaign.manifest import MANIFEST
from correlation.campaign.measurement import LOAD_CELL, Campaign, MeasuredSensor
from correlation.errors import CampaignError
from correlation.model import ROTATIONS, AnySensor, LineSensor, LoadCell, Model, Row, Sensor

#: A sensor is at a node that is nearer than this share of the structure's size.
MAX_NODE_DISTANCE = 0.01


def with_sensors(model: Model, campaign: Campaign) -> Model:
    """The model with every sensor of the campaign.

    A sensor that the model has by its name is kept, gain and all; others are placed as the manifest says.

    Parameters
    ----------
    model
        Model with its places, lines and degrees of freedom.
    campaign
        Campaign with its sensors.

    Raises
    ------
    CampaignError
        A sensor that cannot be placed or measures something else than the model's, a harmonic that the model does not
        keep, or a contact force of the structure without its contacts.
    """
    own = {sensor.name: sensor for sensor in model.sensors}
    named = {measured.name for measured in campaign.sensors}
    others = [sensor for sensor in model.sensors if sensor.name not in named]
    added = []
    for measured in campaign.sensors:
        if measured.name in own:
            _check_same(measured, own[measured.name], model)
            continue
        try:
            added.append(_place_sensor(measured, model))
        except CampaignError as error:
            raise CampaignError(f"{error}{_offer_sensor(measured, others, model)}") from None
    _check_harmonics(model, campaign)
    _check_drive(model, campaign)
    _check_free(campaign)
    return replace(model, sensors=(*model.sensors, *added))


def _offer_sensor(measured: MeasuredSensor, others: Sequence[AnySensor], model: Model) -> str:
    """End of a sentence about a sensor that cannot be placed: one of the case with nearly its name, and where it is."""
    same = {sensor.name: sensor for sensor in others if isinstance(sensor, Sensor)}
    close = get_close_matches(measured.name, same, 1)
    if not close or measured.line is not None or measured.quantity != same[close[0]].quantity:
        return ""
    reads = [place for place, row in model.places.items() if np.any(row * same[close[0]].row)]
    place = f', and place = "{reads[0]}"' if measured.place is not None and reads else ""
    return f'; did you mean the case\'s sensor "{close[0]}"? then give it this name here and in its columns{place}'


def _check_same(measured: MeasuredSensor, sensor: AnySensor, model: Model) -> None:
    if isinstance(sensor, Sensor):
        says, reads = sensor.quantity, measured.quantity
    elif isinstance(sensor, LoadCell):
        says, reads = LOAD_CELL, measured.quantity
    else:
        says = f"{sensor.component} force of {sensor.line}"
        reads = f"{measured.component} force of {measured.line}" if measured.line is not None else measured.quantity
    if says != reads:
        raise CampaignError(
            f'{MANIFEST}: sensor "{measured.name}" measures {reads}, the model\'s sensor of that name {says}: correct '
            "one of them, or give it another name"
        )
    if isinstance(sensor, Sensor):
        _check_same_point(measured, sensor, model)


def _check_same_point(measured: MeasuredSensor, sensor: Sensor, model: Model) -> None:
    # The model's sensor may have a gain, lean, or subtract another place, but it reads some of this motion.
    axes = {dof.direction for dof, part in zip(model.dofs, sensor.row, strict=False) if part}
    if not measured.direction and axes and axes <= {*ROTATIONS}:
        raise CampaignError(
            f'{MANIFEST}: sensor "{measured.name}" reads a rotation, which decides its unit: add '
            f'direction = "{min(axes)}"'
        )
    if measured.direction and axes and not axes & {measured.direction, measured.toward, "modal"}:
        raise CampaignError(
            f'{MANIFEST}: sensor "{measured.name}" reads along {measured.direction}, the model\'s sensor of that name '
            f"along {' and '.join(sorted(axes))}: correct one of them, or leave direction out"
        )
    if measured.place is None or not model.places:
        return
    if not np.any(_place_row(measured, model, measured.place) * sensor.row):
        raise CampaignError(
            f'{MANIFEST}: sensor "{measured.name}" sits at place "{measured.place}", which the model\'s sensor of that '
            "name does not read: correct one of them, or give it another name"
        )


def _place_sensor(measured: MeasuredSensor, model: Model) -> AnySensor:
    name = measured.name
    if measured.line is not None:
        if measured.line not in model.lines:
            listed = ", ".join(model.lines) or "none"
            raise CampaignError(
                f'{MANIFEST}: sensor "{name}" measures line "{measured.line}", which the model does not have; '
                f"its lines: {listed}"
            )
        return LineSensor(name=name, line=measured.line, component=str(measured.component))
    if measured.quantity == LOAD_CELL:
        if measured.cell not in model.load_cells:
            listed = ", ".join(model.load_cells) or "none"
            raise CampaignError(
                f'{MANIFEST}: sensor "{name}" is load cell "{measured.cell}", which the model does not have; '
                f"its load cells: {listed}"
            )
        return replace(model.load_cells[str(measured.cell)], name=name)
    row = _place_row(measured, model, measured.place) if measured.place is not None else _find_nearest(measured, model)
    if measured.inclination:
        row = cos(measured.inclination) * row + sin(measured.inclination) * _turn_row(measured, model, row)
    if measured.relative_to is not None:
        other = _place_row(measured, model, measured.relative_to)
        if measured.inclination:
            other = cos(measured.inclination) * other + sin(measured.inclination) * _turn_row(measured, model, other)
        row = row - other
    return Sensor(name=name, row=row, quantity=measured.quantity)


def _place_row(measured: MeasuredSensor, model: Model, place: str) -> Row:
    if place not in model.places:
        raise CampaignError(
            f'{MANIFEST}: sensor "{measured.name}" sits at place "{place}", which the model does not have; '
            f"{offer_places(model, place)}"
        )
    return model.places[place]


def offer_places(model: Model, place: str) -> str:
    """End of a sentence about a place that a model lacks: the places that it has, and the remedy."""
    listed = ", ".join(model.places) or "none"
    return f'its places: {listed}. Correct the name, or add a [[place]] with name = "{place}" to the case'


def _turn_row(measured: MeasuredSensor, model: Model, row: Row) -> Row:
    """The row of the same points in the direction in which the sensor leans."""
    turned = np.zeros_like(row)
    number = {(dof.body, dof.node, dof.direction): place for place, dof in enumerate(model.dofs)}
    for place in np.flatnonzero(row):
        dof = model.dofs[place]
        other = number.get((dof.body, dof.node, measured.toward))
        if dof.direction == measured.direction and other is not None:
            turned[other] = row[place]
            continue
        raise CampaignError(
            f'{MANIFEST}: sensor "{measured.name}" leans toward {measured.toward}, but the model has no motion of '
            f"its point in the directions {measured.direction} and {measured.toward}: remove inclination, or keep both "
            "directions of that point in the model"
        )
    return turned


def _find_nearest(measured: MeasuredSensor, model: Model) -> Row:
    name, wanted = measured.name, measured.coordinates
    if wanted is None:
        raise CampaignError(
            f'{MANIFEST}: the model has no sensor "{name}": add it to the case, or give its place or coordinates'
        )
    known = [
        (number, dof.coordinates)
        for number, dof in enumerate(model.dofs)
        if dof.coordinates is not None and dof.direction == measured.direction
    ]
    if not known:
        raise CampaignError(
            f'{MANIFEST}: sensor "{name}" has coordinates, but the model has no degree of freedom in direction '
            f"{measured.direction} with coordinates: give the sensor a place"
        )
    at = np.array([coordinates for _, coordinates in known])
    distance = np.linalg.norm(at - wanted, axis=1)
    nearest = int(np.argmin(distance))
    size = float(np.linalg.norm(np.ptp(at, axis=0)))
    if distance[nearest] > MAX_NODE_DISTANCE * size:
        raise CampaignError(
            f'{MANIFEST}: sensor "{name}" is {distance[nearest]:.3g} m from the nearest node of the model, at '
            f"({', '.join(f'{x:.4g}' for x in at[nearest])}) m: check its coordinates and their unit, or name a place"
        )
    row = np.zeros(model.system.n_dof)
    row[known[nearest][0]] = 1.0
    return row


def _check_drive(model: Model, campaign: Campaign) -> None:
    shaken = campaign.drive.quantity == "base acceleration"
    if shaken and len(campaign.measurement) and model.base_acceleration is None:
        raise CampaignError(
            f'{MANIFEST}: drive.quantity = "base acceleration", but the case has a force: shake its supports by '
            '[[load]] with base = "z", or the axis of the shaker'
        )
    if shaken and model.level_power:
        raise CampaignError(
            f"{MANIFEST}: drive.quantity is the acceleration of the base, but the case gives its velocity or "
            "displacement: give it as acceleration in [[load]]"
        )
    if not shaken and model.base_acceleration is not None:
        raise CampaignError(
            f'{MANIFEST}: drive.quantity = "{campaign.drive.quantity}", but the case shakes a base: write '
            'drive.quantity = "base acceleration", or give the case the load'
        )


def _check_harmonics(model: Model, campaign: Campaign) -> None:
    highest = int(campaign.measurement.harmonic.max(initial=0))
    if highest >= model.n_harmonic:
        raise CampaignError(
            f"the campaign has harmonic {highest}, the model keeps {model.n_harmonic - 1}: raise harmonics.highest in "
            "the case"
        )


def _check_free(campaign: Campaign) -> None:
    table = campaign.measurement
    for number, test in enumerate(campaign.tests):
        if test.configuration == "free":
            for sensor in np.unique(table.sensor[table.test == number]):
                if campaign.sensors[sensor].line is not None:
                    raise CampaignError(
                        f'{MANIFEST}: test "{test.name}" is free of contacts, but "{campaign.sensors[sensor].name}" '
                        "measures a contact's force in it: remove its rows"
                    )
