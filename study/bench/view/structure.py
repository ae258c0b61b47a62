"""View of the structure in space: bodies, sensors, contact lines and moving shapes; only names without geometry."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.model import LineSensor, LoadCell, Model, Sensor
from fe.dense_modes import compute_dense_modes
from figure.style import CONTACT_STATES
from study.bench.view.operation import Operation
from study.case.surface import BodySurface
from study.page.number import round_list

#: Number of shown modes, and largest shown displacement as a fraction of the structure's size [-].
MODES, SHOWN = 6, 0.12
#: Largest ratio of the second to the first singular value of the positions of a chain of nodes [-].
STRAIGHT = 0.05
#: Digits of shapes.
DIGITS = 4
AXES = "xyz"
#: Names of the states 0, 1 and 2 of a contact.
STATES = ("stuck", "slipping", "separated")
#: Kinds of sensors of forces, in words.
FORCES: Mapping[type, str] = {LineSensor: "force of a line", LoadCell: "load cell"}

Place = Float[NDArray[np.float64], "3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A drawn body, or marks on bodies.

    Parameters
    ----------
    name
        Name of the body in the degrees of freedom; for marks the name of the sensor or contact line.
    points
        Coordinates, shape (p, 3) [m].
    motion
        Displacement of the points per unit of the coordinates of the structure, shape (p, 3, r) [- and m].
    triangles
        Triangles on the outer surface, shape (t, 3) [-]; empty for a chain or cloud of nodes.
    """

    name: str
    points: Float[NDArray[np.float64], "p 3"]
    motion: Float[NDArray[np.float64], "p 3 r"]
    triangles: Int[NDArray[np.int64], "t 3"] = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))


def show_structure(
    model: Model, surfaces: Mapping[str, BodySurface] | None = None, operations: Sequence[Operation] = ()
) -> dict[str, Any]:
    """Make the view of the structure of a model.

    Parameters
    ----------
    model
        Model with the coordinates of its nodes in the degrees of freedom.
    surfaces
        Outer surfaces of bodies, by name; without surfaces nodes are drawn.
    operations
        Steady states whose shapes are shown.

    Returns
    -------
    "bodies" with coordinates [m]: surfaces, chains or clouds; "marks" of sensors, contact lines and the load; "modes"
    with frequencies [Hz] and "operations", whose "shape" has the enlarged displacements of each body and then of each
    mark [m]; the "state_colours" of contacts; and "rows" with the names of sensors and contact lines. Without
    coordinates, all except "rows" are empty.
    """
    bodies = _list_bodies(model, surfaces or {})
    if not bodies:
        return {"bodies": [], "marks": [], "modes": [], "operations": [], "rows": _list_rows(model)}
    size = float(np.ptp(np.concatenate([body.points for body in bodies]), axis=0).max())
    marks = _list_marks(model)
    moving = [*bodies, *(mark for _, mark in marks)]
    return {
        "bodies": [
            {
                "name": body.name,
                "points": _list_columns(body.points),
                "triangles": body.triangles.T.tolist(),
                "is_chain": not len(body.triangles) and _is_chain(body.points),
            }
            for body in bodies
        ],
        "marks": [{"kind": kind, "name": mark.name, "points": _list_columns(mark.points)} for kind, mark in marks],
        "modes": _list_modes(model, moving, size),
        "state_colours": [CONTACT_STATES[name] for name in STATES],
        "operations": [_show_operation(operation, moving, size) for operation in operations],
        "rows": _list_rows(model),
    }


def _list_bodies(model: Model, surfaces: Mapping[str, BodySurface]) -> list[Body]:
    """List the surfaces of bodies; without surfaces the nodes of each body, ordered along the longest side."""
    n_dof = model.system.n_dof
    bodies = [
        Body(name=name, points=item.points, triangles=item.triangles, motion=item.motion)
        for name, item in surfaces.items()
        if item.motion.shape[2] == n_dof
    ]
    if bodies:
        return bodies
    nodes: dict[str, dict[int, Place]] = {}
    for dof in model.dofs:
        if dof.coordinates is not None:
            nodes.setdefault(dof.body, {})[dof.node] = np.asarray(dof.coordinates)
    if not nodes:
        return []
    axis = int(np.ptp([point for body in nodes.values() for point in body.values()], axis=0).argmax())
    for name, body in nodes.items():
        ordered = sorted(body, key=lambda node: body[node][axis])
        number = {node: place for place, node in enumerate(ordered)}
        motion = np.zeros((len(ordered), 3, n_dof))
        for column, dof in enumerate(model.dofs):
            if dof.body == name and dof.coordinates is not None and dof.direction in AXES:
                motion[number[dof.node], AXES.index(dof.direction), column] = 1.0
        points = np.array([body[node] for node in ordered])
        bodies.append(Body(name=name, points=points, motion=motion))
    return bodies


def _is_chain(points: Float[NDArray[np.float64], "n 3"]) -> bool:
    """Whether points are on a line, so that a line between them shows the body."""
    if len(points) < 3:
        return True
    size = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(size[1] <= STRAIGHT * size[0])


def _list_modes(model: Model, bodies: Sequence[Body], size: float) -> list[dict[str, Any]]:
    modes = compute_dense_modes(model.system.mass, model.system.stiffness)
    return [
        {"frequency": float(modes.frequency[mode]), **_shape(bodies, modes.mode_shapes[:, mode].astype(complex), size)}
        for mode in range(min(MODES, len(modes.frequency)))
    ]


def _show_operation(operation: Operation, bodies: Sequence[Body], size: float) -> dict[str, Any]:
    facts = {"label": operation.label, "states": {name: rows.tolist() for name, rows in operation.states.items()}}
    return {**facts, **_shape(bodies, operation.motion, size)}


def _shape(bodies: Sequence[Body], motion: Complex[NDArray[np.complex128], " r"], size: float) -> dict[str, Any]:
    """Compute real and imaginary parts of the enlarged displacement of each body, and the factor of enlargement [-]."""
    fields = [body.motion @ motion for body in bodies]
    largest = max(float(np.linalg.norm(np.abs(field), axis=1).max()) for field in fields)
    factor = SHOWN * size / largest if largest else 0.0
    parts = [[_list_columns(factor * field.real), _list_columns(factor * field.imag)] for field in fields]
    is_real = not any(field.imag.any() for field in fields)
    return {"shape": [[real] if is_real else [real, imaginary] for real, imaginary in parts], "enlarged": factor}


def _list_columns(values: Float[NDArray[np.float64], "p 3"]) -> list[list[float | None]]:
    return [round_list(column, DIGITS) for column in values.T]


def _list_marks(model: Model) -> list[tuple[str, Body]]:
    """List the marks of sensors, contact lines and the load at the positions of their rows, each with its kind."""
    rows = [("sensor", item.name, [item.row]) for item in model.sensors if not isinstance(item, LineSensor)]
    rows += [
        ("contact line", line, [model.contact(name).normal for name in members])
        for line, members in model.lines.items()
    ]
    rows.append(("load", "load", [np.abs(model.system.dynamic).sum(axis=0)]))
    marks = []
    for kind, name, listed in rows:
        result = [mark for row in listed if (mark := _find_mark(model, row)) is not None]
        if result:
            points, motion = (np.array(part) for part in zip(*result, strict=True))
            marks.append((kind, Body(name=name, points=points, motion=motion)))
    return marks


def _find_mark(
    model: Model, row: Float[NDArray[np.float64], " r"]
) -> tuple[Place, Float[NDArray[np.float64], "3 r"]] | None:
    """Find position and motion of a row: the mean of its nodes, weighted by the row; None for an empty row."""
    weights: dict[tuple[str, int], float] = {}
    places: dict[tuple[str, int], Place] = {}
    for dof, value in zip(model.dofs, row, strict=False):
        if value and dof.coordinates is not None and dof.direction in AXES:
            node = dof.body, dof.node
            weights[node] = weights.get(node, 0.0) + abs(float(value))
            places[node] = np.asarray(dof.coordinates)
    if not weights:
        return None
    total = sum(weights.values())
    motion = np.zeros((3, model.system.n_dof))
    for column, dof in enumerate(model.dofs):
        if dof.coordinates is not None and dof.direction in AXES:
            motion[AXES.index(dof.direction), column] = weights.get((dof.body, dof.node), 0.0) / total
    return np.sum([weights[node] / total * place for node, place in places.items()], axis=0), motion


def _list_rows(model: Model) -> list[dict[str, Any]]:
    """List names of sensors and contact lines, with the quantity of each sensor and number of contacts of each line."""
    rows = [
        {"name": sensor.name, "kind": sensor.quantity if isinstance(sensor, Sensor) else FORCES[type(sensor)]}
        for sensor in model.sensors
    ]
    return [*rows, *({"name": name, "kind": f"{len(members)} contacts"} for name, members in model.lines.items())]
