"""The structure in space: nodes, sensors, contact lines and mode shapes; rows alone where there is no geometry."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.model import LineSensor, LoadCell, Model, Sensor
from fe.dense_modes import compute_dense_modes
from study.page.number import round_list

#: Modes that are shown, and the length of the largest displacement, as a share of the structure's size [-].
MODES, SHOWN = 6, 0.12
#: Nodes of a body are a chain if none is further off their line than this share of its length [-].
STRAIGHT = 0.05
AXES = "xyz"
#: Kinds of sensors of forces, in words.
FORCES: Mapping[type, str] = {LineSensor: "force of a line", LoadCell: "load cell"}

Place = Float[NDArray[np.float64], "3"]


def show_structure(model: Model) -> dict[str, Any]:
    """Structure of a model as its degrees of freedom tell it.

    Returns
    -------
    "nodes" with coordinates [m] and places along their "bodies", which are chains or clouds; "marks" of sensors,
    contact lines and the load; "modes" with frequencies [Hz] and displacements of the nodes [m]. All empty but "rows"
    without coordinates.
    """
    nodes = _list_nodes(model)
    if not nodes:
        return {"nodes": [], "bodies": [], "marks": [], "modes": [], "rows": _list_rows(model)}
    points = np.array([point for _, point in nodes.values()])
    number = {node: place for place, node in enumerate(nodes)}
    return {
        "nodes": [
            {"body": body, "point": round_list(point), "order": place}
            for place, (body, point) in enumerate(nodes.values())
        ],
        "bodies": [
            {"name": name, "is_chain": _is_chain(np.array([point for body, point in nodes.values() if body == name]))}
            for name in dict.fromkeys(body for body, _ in nodes.values())
        ],
        "marks": _list_marks(model),
        "modes": _list_modes(model, number, float(np.ptp(points, axis=0).max())),
        "rows": _list_rows(model),
    }


def _list_nodes(model: Model) -> dict[tuple[str, int], tuple[str, Place]]:
    """Body and coordinates of each node, by body and number, along the longest side of each body."""
    found = {
        (dof.body, dof.node): (dof.body, np.asarray(dof.coordinates))
        for dof in model.dofs
        if dof.coordinates is not None
    }
    if not found:
        return {}
    axis = int(np.ptp([point for _, point in found.values()], axis=0).argmax())
    return dict(sorted(found.items(), key=lambda item: (item[1][0], item[1][1][axis])))


def _is_chain(points: Float[NDArray[np.float64], "n 3"]) -> bool:
    """Whether points lie on a line, so that a line between them shows the body."""
    if len(points) < 3:
        return True
    size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(size[1] <= STRAIGHT * size[0])


def _list_modes(model: Model, number: Mapping[tuple[str, int], int], size: float) -> list[dict[str, Any]]:
    modes = compute_dense_modes(model.system.mass, model.system.stiffness)
    frequency = modes.frequency
    result = []
    for column in range(min(MODES, len(frequency))):
        shape = np.zeros((len(number), 3))
        for dof, value in zip(model.dofs, modes.mode_shapes[:, column], strict=True):
            if dof.coordinates is not None and dof.direction in AXES:
                shape[number[dof.body, dof.node], AXES.index(dof.direction)] = value
        largest = np.linalg.norm(shape, axis=1).max()
        if largest:
            shape *= SHOWN * size / largest
        result.append({"frequency": float(frequency[column]), "shape": [round_list(row) for row in shape]})
    return result


def _list_marks(model: Model) -> list[dict[str, Any]]:
    """Sensors, contacts and the load where their rows are."""
    marks = [
        {"kind": "sensor", "name": sensor.name, "points": _point(model, sensor.row)}
        for sensor in model.sensors
        if not isinstance(sensor, LineSensor)
    ]
    for line, members in model.lines.items():
        points = [point for name in members for point in _point(model, model.contact(name).normal)]
        marks.append({"kind": "contact line", "name": line, "points": points})
    load = np.abs(model.system.dynamic).sum(axis=0)
    marks.append({"kind": "load", "name": "load", "points": _point(model, load)})
    return [mark for mark in marks if mark["points"]]


def _point(model: Model, row: Float[NDArray[np.float64], " r"]) -> list[list[float | None]]:
    """Where a row acts: the mean of its nodes, weighted by its size; none if it acts on no point."""
    there = [
        (abs(float(value)), dof.coordinates)
        for dof, value in zip(model.dofs, row, strict=False)
        if value and dof.coordinates is not None and dof.direction in AXES
    ]
    if not there:
        return []
    weights, points = zip(*there, strict=True)
    return [round_list(np.average(np.array(points), axis=0, weights=weights))]


def _list_rows(model: Model) -> list[dict[str, Any]]:
    """Sensors and contact lines in words, with what they read."""
    rows = [
        {"name": sensor.name, "kind": sensor.quantity if isinstance(sensor, Sensor) else FORCES[type(sensor)]}
        for sensor in model.sensors
    ]
    return [*rows, *({"name": name, "kind": f"{len(members)} contacts"} for name, members in model.lines.items())]
