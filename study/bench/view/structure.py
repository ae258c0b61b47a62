"""The structure in space: bodies, sensors, contact lines and moving shapes; rows alone where there is no geometry."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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

#: Modes that are shown, and the length of the largest displacement, as a share of the structure's size [-].
MODES, SHOWN = 6, 0.12
#: Nodes of a body are a chain if none is further off their line than this share of its length [-].
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
    """A body as it is drawn.

    Parameters
    ----------
    name
        As the degrees of freedom call it.
    points
        Shape (p, 3) [m].
    triangles
        On its outside, shape (t, 3) [-]; none of a chain or cloud of nodes.
    motion
        Displacement of the points by the coordinates of the structure, shape (p, 3, r) [- and m].
    """

    name: str
    points: Float[NDArray[np.float64], "p 3"]
    triangles: Int[NDArray[np.int64], "t 3"]
    motion: Float[NDArray[np.float64], "p 3 r"]


def show_structure(
    model: Model, surfaces: Mapping[str, BodySurface] | None = None, operations: Sequence[Operation] = ()
) -> dict[str, Any]:
    """Structure of a model.

    Parameters
    ----------
    model
        The model; its degrees of freedom tell where their nodes are.
    surfaces
        Outsides of bodies, by name; nodes are drawn where they are not known.
    operations
        Steady states whose shapes are shown.

    Returns
    -------
    "bodies" with coordinates [m]: surfaces, chains or clouds; "marks" of sensors, contact lines and the load; "modes"
    with frequencies [Hz] and "operations", whose "shape" holds displacements of each body [m], enlarged; and the
    "state_colours" of contacts. All empty but "rows" without coordinates.
    """
    bodies = _list_bodies(model, surfaces or {})
    if not bodies:
        return {"bodies": [], "marks": [], "modes": [], "operations": [], "rows": _list_rows(model)}
    size = float(np.ptp(np.concatenate([body.points for body in bodies]), axis=0).max())
    return {
        "bodies": [
            {
                "name": body.name,
                "points": _columns(body.points),
                "triangles": body.triangles.T.tolist(),
                "is_chain": not len(body.triangles) and _is_chain(body.points),
            }
            for body in bodies
        ],
        "marks": _list_marks(model),
        "modes": _list_modes(model, bodies, size),
        "state_colours": [CONTACT_STATES[name] for name in STATES],
        "operations": [_show_operation(operation, bodies, size) for operation in operations],
        "rows": _list_rows(model),
    }


def _list_bodies(model: Model, surfaces: Mapping[str, BodySurface]) -> list[Body]:
    """Surfaces where they are known, and nodes along the longest side of each other body."""
    n_dof = model.system.n_dof
    bodies = [
        Body(name=name, points=each.points, triangles=each.triangles, motion=each.motion)
        for name, each in surfaces.items()
        if each.motion.shape[2] == n_dof
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
        bodies.append(Body(name=name, points=points, triangles=np.zeros((0, 3), dtype=np.int64), motion=motion))
    return bodies


def _is_chain(points: Float[NDArray[np.float64], "n 3"]) -> bool:
    """Whether points lie on a line, so that a line between them shows the body."""
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
    """Real and imaginary parts of the displacement of each body, enlarged to what is seen; and how much [-]."""
    fields = [body.motion @ motion for body in bodies]
    largest = max(float(np.linalg.norm(np.abs(field), axis=1).max()) for field in fields)
    factor = SHOWN * size / largest if largest else 0.0
    parts = [[_columns(factor * field.real), _columns(factor * field.imag)] for field in fields]
    is_real = not any(field.imag.any() for field in fields)
    return {"shape": [[real] if is_real else [real, imaginary] for real, imaginary in parts], "enlarged": factor}


def _columns(values: Float[NDArray[np.float64], "p 3"]) -> list[list[float | None]]:
    return [round_list(column, DIGITS) for column in values.T]


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
