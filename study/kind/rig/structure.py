"""The structure of a rig at rest under its dead weights: matrices, contacts, excitation, sensors and load cells."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import cos, pi, sin

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from casefile.source import find_value
from casefile.table import located
from correlation.model import DeadWeight, Dof, Head, LoadCell, Sensor, StructurePart, Wire
from fe.distributed_load import distribute_load
from geometry.errors import InputError
from geometry.rig import SIDES, Rig, named_points
from reduction.elastic_support import ElasticBody
from reduction.file.structure_file import StructureMatrices
from reduction.joined_bodies import JoinedBodies, join_bodies, make_jointed_system
from reduction.rigid_body import RigidBody, check_supported, make_rigid_body, make_unit_motions
from reduction.settled_gaps import settle_bodies
from reduction.static_contact import StaticState
from study.case.structure import Structure
from study.case.surface import BodySurface, make_surface
from study.case.tables import Case
from study.kind.rig.contact import WirePull, list_dead_weights, make_line_pairs
from study.kind.rig.model import RigModel, Y, Z, mesh_in_tetrahedra
from study.kind.rig.reduction import RigReduction, reduce_rig
from study.kind.rig.table import LaserTable, RigTable, make_rig_model
from study.reduce.report import report_fewer_rig_modes
from study.run_context import RunContext

Row = Float[NDArray[np.float64], " r"]

Matrix = Float[NDArray[np.float64], "r r"]

#: Fixed faces at the ends of the arms, and sign of the arms' slope away from the blade.
ARMS = {"cell_upper": 1.0, "cell_lower": -1.0}
#: Load cells by name: side and fixed face. R3 and R4 of eq. 1 are on the right; the left side is the mirror image.
LOAD_CELLS = {
    "R1": ("left", "cell_upper"), "R2": ("left", "cell_lower"),
    "R3": ("right", "cell_upper"), "R4": ("right", "cell_lower"),
}  # fmt: skip
#: Round-off of node positions [m].
ROUND_OFF = 1e-9
#: Largest fraction of the friction limit in the contacts of a random friction history [-].
HISTORY = 0.9
#: Frequency of the rigid motions of dampers without contacts, on the springs of their suspension [Hz].
SUSPENSION = 20.0


@dataclass(frozen=True, kw_only=True, eq=False)
class PreloadedRig:
    """A rig in static equilibrium under its dead weights.

    Parameters
    ----------
    model, reduction
        Dimensions and meshes of the rig, and its reduced bodies.
    weights
        Pull of the wire on each side.
    joined
        Bodies and contacts without loads.
    wires
        Loads of the wire of each side, over all coordinates.
    static_state
        Static state of the contacts under the dead weights.
    dampers
        Dampers as rigid bodies on their contacts.
    """

    model: RigModel
    reduction: RigReduction
    weights: Mapping[str, WirePull]
    joined: JoinedBodies
    wires: Mapping[str, Wire]
    static_state: StaticState
    dampers: tuple[RigidBody, ...]


def make_preloaded_rig(case: Case[RigTable], model: RigModel, reduction: RigReduction) -> PreloadedRig:
    """Join the bodies of a rig and compute its static equilibrium under the dead weights.

    Raises
    ------
    CaseError
        A damper is unsupported, leaves its groove or has no equilibrium.
    """
    assembly, table, rig = reduction.assembly, case.structure, model.rig
    weights = list_dead_weights(case)
    with located(case, "structure", "contact"):
        bodies = join_bodies(assembly, make_line_pairs(case, rig), tangents=table.contact.sliding)
    dampers = tuple(
        make_rigid_body(assembly, f"damper_{side}", reduction.places(f"damper_{side}"), bodies.springs)
        for side in SIDES
    )
    with located(case, "structure", "contact"):
        check_supported(dampers)
    if any(getattr(table.contact, name).uneven for name in bodies.lines):
        bodies = settle_bodies(bodies, _list_damper_motions(reduction))
    wires = {side: _make_wire(side, pull, rig, reduction) for side, pull in weights.items()}
    try:
        rest = bodies.static_state(np.sum([wire.load for wire in wires.values()], axis=0))
    except InputError as error:
        with located(case, "structure", "dead_weight", *_find_side_at_fault(case, str(error))):
            raise error
    return PreloadedRig(
        model=model,
        reduction=reduction,
        weights=weights,
        joined=bodies,
        wires=wires,
        static_state=rest,
        dampers=dampers,
    )


def _find_side_at_fault(case: Case[RigTable], message: str) -> tuple[str, ...]:
    """Find the table of the side of the contact line that a message names, if the case has this table."""
    given = find_value({} if case.source is None else case.source.data, ("structure", "dead_weight")) or {}
    return tuple(side for side in SIDES if f'"{side}_' in message and side in given)[:1]


def _list_damper_motions(reduction: RigReduction) -> dict[str, Float[NDArray[np.float64], "r 6"]]:
    """List the rigid motions of the dampers, which only contacts support."""
    return {
        body: make_unit_motions(reduction.assembly, body, reduction.places(body), np.zeros(3))
        for body in (f"damper_{side}" for side in SIDES)
    }


def excitation(reduction: RigReduction) -> Complex[NDArray[np.complex128], "2 r"]:
    """Make a harmonic force of 1 N along y on the disc that the shaker pushes, shape (2, r) [N]."""
    force = np.zeros((2, reduction.assembly.n_dof), dtype=np.complex128)
    force[1, reduction.assembly.rows("blade", "excitation", Y)] = 1.0
    return force


def _make_wire(side: str, pull: WirePull, rig: Rig, reduction: RigReduction) -> Wire:
    """Make the wire of a side, whose load is distributed over its width on the lower half of the cylinder."""
    body, (sign, _) = f"damper_{side}", SIDES[side]
    mesh, place = reduction.meshes[body], named_points(rig)[body]["dead_weight"]
    cylinder = mesh.nodes("cylinder")
    below = cylinder[mesh.points[cylinder, Z] < rig.damper_axis]
    if pull.width is not None:
        away = np.abs(mesh.points[below, Y] - place[Y] - sign * pull.shift)
        # A wire thinner than an element loads the nearest nodes; nodes at its edges are within round-off.
        below = below[away <= max(pull.width / 2, float(away.min())) + ROUND_OFF]

    def load(direction: int, shift: float) -> Row:
        nodal = distribute_load(mesh, below, np.eye(3)[direction], place + np.array([0.0, sign * shift, 0.0]))
        return reduction.assembly.load(body, nodal)

    upright = load(Z, 0.0)
    return Wire(
        force=pull.force, shift=pull.shift, inclination=pull.inclination, horizontal=load(Y, 0.0), vertical=upright,
        moment=load(Z, 1.0) - upright,
    )  # fmt: skip


def make_rig_structure(case: Case[RigTable], run: RunContext) -> Structure:
    """Make the rig of a case, at rest under its dead weights.

    Parameters
    ----------
    case
        Case of a rig.
    run
        Store of the reduced bodies, and progress.

    Raises
    ------
    CaseError
        Bodies cannot be built or do not mate; a damper is unsupported, leaves its groove or has no equilibrium.
    """
    model = make_rig_model(case)
    list_dead_weights(case)  # checked before the reduction, which takes minutes
    with located(case, "structure", "mesh"):
        model = mesh_in_tetrahedra(model, run.store, run.progress)
        reduction = reduce_rig(model, run.store, run.progress)
    for sentence in report_fewer_rig_modes(reduction.assembly, model.n_mode):
        run.note(sentence)
    preloaded = make_preloaded_rig(case, model, reduction)
    force = excitation(reduction)
    system = make_jointed_system(preloaded.joined, preloaded.static_state, case.structure.damping.ratio, force)
    return Structure(
        matrices=StructureMatrices(mass=system.mass, damping=system.damping, stiffness=system.stiffness),
        dofs=_list_dofs(reduction),
        parts=_list_parts(preloaded),
        places=list_measured_places(reduction),
        joints=tuple(system.joints),
        lines=preloaded.joined.lines,
        static_load=preloaded.static_state.load,
        harmonic_force=force,
        sensors=_make_sensors(reduction, case.structure.laser),
        dead_weights={
            f"{side} dead weight": DeadWeight.on_wire(
                wire, tuple(name for name in preloaded.joined.lines if name.startswith(side))
            )
            for side, wire in preloaded.wires.items()
        },
        elastic_bodies=_list_elastic_bodies(reduction),
        load_cells=find_load_cells(preloaded),
        suspension=make_suspension(reduction),
        loss_factor=case.structure.damping.loss_factor,
        histories=partial(list_friction_histories, preloaded.static_state, preloaded.joined),
        surfaces=partial(_list_surfaces, reduction),
        details=preloaded,
    )


def list_measured_places(reduction: RigReduction) -> dict[str, Row]:
    """List the places where tests of the rig measure and effects may act: rows of motions along y."""
    result = {
        "tip": _make_row(reduction, "blade", "response"),
        "excitation": _make_row(reduction, "blade", "excitation"),
        "slot": (_make_row(reduction, "blade", "laser_left") + _make_row(reduction, "blade", "laser_right")) / 2,
    }
    return result | {f"damper_{side}": _make_row(reduction, f"damper_{side}", "laser_blade") for side in SIDES}


def find_load_cells(preloaded: PreloadedRig) -> dict[str, LoadCell]:
    """Make the load cells by name: each reads the push of its arm along the arm.

    The reaction of the fixed end is computed from the stiffness only: the inertia of the mass between the end and the
    adjacent nodes is neglected, as this mass moves far less than the contact.
    """
    alpha, result = preloaded.model.rig.decoupler.arm_angle, {}
    for name, (side, cell) in LOAD_CELLS.items():
        arm = compute_arm_direction(side, cell, alpha)
        row = -arm @ preloaded.reduction.reactions[f"decoupler_{side}"][cell].stiffness
        result[name] = LoadCell(name=name, row=row, at_rest=float(row @ preloaded.static_state.displacement))
    return result


def compute_arm_direction(side: str, cell: str, angle: float) -> Float[NDArray[np.float64], "3"]:
    """Unit vector along an arm at an angle [rad] from the contact line to the load cell, shape (3,) [-]."""
    return np.array([0.0, SIDES[side][0] * cos(angle), ARMS[cell] * sin(angle)])


def make_suspension(reduction: RigReduction) -> Matrix:
    """Make the stiffness of the dampers' suspension without contacts [N/m], for rigid motions at `SUSPENSION`."""
    assembly = reduction.assembly
    result = np.zeros((assembly.n_dof, assembly.n_dof))
    for body in (f"damper_{side}" for side in SIDES):
        own = assembly.columns(body)
        result[own, own] = (2 * pi * SUSPENSION) ** 2 * assembly.mass[own, own]
    return result


def list_friction_histories(rest: StaticState, bodies: JoinedBodies, n: int, seed: int) -> list[Row]:
    """List the initial slider positions of friction histories [m].

    Parameters
    ----------
    rest, bodies
        Rig under its dead weights.
    n
        Number of histories [-]; the first is rest under the dead weights, in the others each line has a random fraction
        of its friction limit.
    seed
        Seed of the random fractions.
    """
    generator = np.random.default_rng(seed)
    histories = [rest.slider]
    for _ in range(n - 1):
        shares = {line: generator.uniform(-HISTORY, HISTORY) for line in bodies.lines}
        histories.append(
            _push_sliders(rest, {name: shares[line] for line, names in bodies.lines.items() for name in names})
        )
    return histories


def _push_sliders(rest: StaticState, share: dict[str, float]) -> Row:
    """Move the sliders along the line, so that each contact has a fraction (`share`) of its friction limit at rest."""
    result = []
    for item in rest.contacts:
        first = -share[item.name] * (item.limit_at_rest / item.tangential_stiffness)
        result.append(np.array([first, *[0.0] * (len(item.tangents) - 1)]))
    return np.concatenate(result)


def _list_surfaces(reduction: RigReduction) -> dict[str, BodySurface]:
    """Make the outer surface of each body."""
    assembly = reduction.assembly
    return {
        body: make_surface(reduction.meshes[body], rom, assembly.columns(body), assembly.n_dof)
        for body, rom in assembly.bodies.items()
    }


def _make_row(reduction: RigReduction, body: str, name: str, direction: int = Y) -> Row:
    result = np.zeros(reduction.assembly.n_dof)
    result[reduction.assembly.rows(body, name, direction)] = 1.0
    return result


def _make_sensors(reduction: RigReduction, lean: LaserTable) -> tuple[Sensor, ...]:
    """Make the sensors: the tip, and each damper relative to the blade, at the points of the differential laser."""
    result = [Sensor(name="tip", row=_make_row(reduction, "blade", "response"))]
    for side in SIDES:
        heads = {}
        for body, name, sign, angle in (
            (f"damper_{side}", "laser_blade", 1.0, lean.damper),
            ("blade", f"laser_{side}", -1.0, lean.blade),
        ):
            along, across = (sign * _make_row(reduction, body, name, axis) for axis in (Y, Z))
            heads[body.partition("_")[0]] = Head(along=along, across=across).leaning(angle)
        result.append(Sensor.laser(f"damper {side} against blade", heads))
    return tuple(result)


def _list_parts(preloaded: PreloadedRig) -> tuple[StructurePart, ...]:
    """List mass and stiffness of each body, and of the springs that fix the second tangents."""
    assembly, n = preloaded.reduction.assembly, preloaded.reduction.assembly.n_dof
    result = []
    for body in assembly.bodies:
        mass, stiffness, own = np.zeros((n, n)), np.zeros((n, n)), assembly.columns(body)
        mass[own, own], stiffness[own, own] = assembly.mass[own, own], assembly.stiffness[own, own]
        result.append(StructurePart(name=body, mass=mass, stiffness=stiffness))
    fixed = preloaded.joined.stiffness - preloaded.joined.bodies
    if fixed.any():
        result.append(StructurePart(name="second_tangents", mass=np.zeros((n, n)), stiffness=fixed))
    return tuple(result)


def _list_elastic_bodies(reduction: RigReduction) -> dict[str, ElasticBody]:
    """Return the blade on its clamp, by name of the body."""
    if reduction.root is None:
        return {}
    assembly = reduction.assembly
    return {"blade": reduction.root.embed(assembly.n_dof, assembly.columns("blade"))}


def _list_dofs(reduction: RigReduction) -> tuple[Dof, ...]:
    """Describe each degree of freedom: body, node, direction and coordinates, or modal."""
    result: list[Dof] = []
    for body, rom in reduction.assembly.bodies.items():
        points = reduction.places(body)
        result += [
            Dof(body=body, node=int(node), direction="xyz"[int(axis)], coordinates=points[node])
            for node, axis in zip(rom.boundary_node, rom.boundary_direction, strict=True)
        ]
        result += [Dof(body=body)] * (rom.n_dof - rom.n_boundary)
    return tuple(result)
