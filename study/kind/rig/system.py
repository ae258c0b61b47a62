"""From a rig's case and its reduced bodies to what the solver takes: rest, loads, outputs and curves."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from casefile.errors import CaseError, Problem
from casefile.table import located
from fe.distributed_load import distributed_load
from geometry.errors import InputError
from geometry.rig import SIDES, Rig, named_points
from reduction.joined import Joined, joined, vibrating
from reduction.rigid_body import RigidBody, check_held, rigid_body, rigid_motions
from reduction.seat import seated
from reduction.static_contact import StaticState
from study.kind.rig.contact import DeadWeight, dead_weights, line_pairs
from study.kind.rig.reduction import RigReduction
from study.kind.rig.table import RigCase, RigSweepTable
from study.solve.model import Curve, Output, SolveModel

Row = Float[NDArray[np.float64], " r"]

#: The direction of vibration, through the blade's thickness.
Y = 1
#: Largest share of Coulomb's limit that a drawn history leaves in a contact.
HISTORY = 0.9


@dataclass(frozen=True, kw_only=True, eq=False)
class RestingRig:
    """A rig under its dead weights.

    Parameters
    ----------
    joined
        Bodies and contacts, unloaded.
    pull
        Of the dead weight of each side, over all coordinates, shape (r,) [N].
    rest
        How the dead weights press the contacts.
    dampers
        How the contacts hold them, as rigid bodies.
    """

    joined: Joined
    pull: Mapping[str, Row]
    rest: StaticState
    dampers: tuple[RigidBody, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class RigSystem(RestingRig):
    """The same with what is solved.

    Parameters
    ----------
    model
        Loads, outputs and curves.
    """

    model: SolveModel


def rig_system(case: RigCase, rig: Rig, reduction: RigReduction) -> RigSystem:
    """The rig that a case describes.

    Parameters
    ----------
    case
        As `load_case` returned it, with a sweep.
    rig
        Its dimensions.
    reduction
        Its bodies.

    Raises
    ------
    CaseError
        No sweep; a damper that nothing holds, leaves its groove or finds no rest.
    """
    if case.sweep is None:
        raise CaseError([no_sweep(case)])
    resting = resting_rig(case, rig, reduction)
    bodies, rest = resting.joined, resting.rest
    system = vibrating(bodies, rest, case.damping.ratio, excitation(reduction))
    model = SolveModel(
        system=system,
        outputs=_outputs(reduction),
        curves=_curves(case.sweep, rest, bodies),
        harmonics=case.sweep.harmonics,
        n_sample=case.sweep.n_sample,
    )
    return RigSystem(joined=bodies, pull=resting.pull, rest=rest, dampers=resting.dampers, model=model)


def resting_rig(case: RigCase, rig: Rig, reduction: RigReduction) -> RestingRig:
    """The rig of a case under its dead weights.

    Raises
    ------
    CaseError
        A damper that nothing holds, leaves its groove or finds no rest.
    """
    assembly = reduction.assembly
    with located(case, "contact"):
        bodies = joined(assembly, line_pairs(case, rig), tangents=case.contact.sliding)
    dampers = tuple(
        rigid_body(assembly, f"damper_{side}", reduction.places(f"damper_{side}"), bodies.springs) for side in SIDES
    )
    with located(case, "contact"):
        check_held(dampers)
    if any(getattr(case.contact, name).uneven for name in bodies.lines):
        bodies = seated(bodies, _dampers(reduction))
    pull = _pulls(case, rig, reduction)
    try:
        rest = bodies.rest(np.sum([*pull.values()], axis=0))
    except InputError as error:
        with located(case, "dead_weight", *_side_at_fault(case, str(error))):
            raise error
    return RestingRig(joined=bodies, pull=pull, rest=rest, dampers=dampers)


def _side_at_fault(case: RigCase, message: str) -> tuple[str, ...]:
    """The table of the side that a message on a contact line speaks of, if the case has one."""
    data = {} if case.source is None else case.source.data
    return tuple(side for side in SIDES if f'"{side}_' in message and side in data.get("dead_weight", {}))[:1]


def _dampers(reduction: RigReduction) -> dict[str, Float[NDArray[np.float64], "r 6"]]:
    """Their rigid motions: contact alone holds them."""
    return {
        body: rigid_motions(reduction.assembly, body, reduction.places(body), np.zeros(3))
        for body in (f"damper_{side}" for side in SIDES)
    }


def excitation(reduction: RigReduction) -> NDArray[np.complex128]:
    """A harmonic force of 1 N along y on the disc that the shaker pushes, shape (2, r) [N]."""
    force = np.zeros((2, reduction.assembly.n_dof), dtype=np.complex128)
    force[1, reduction.assembly.rows("blade", "excitation", Y)] = 1.0
    return force


def no_sweep(case: RigCase) -> Problem:
    """A rig's case needs none to be reduced."""
    text = (
        "there is no [sweep], which says what to solve: give one, with from, to, levels and harmonics "
        "(docs/rig.md has an example)"
    )
    return Problem(file="", line=0, key="sweep", text=text) if case.source is None else case.source.problem((), text)


def _pulls(case: RigCase, rig: Rig, reduction: RigReduction) -> dict[str, Row]:
    """The dead weight of each side, spread over the lower half of the cylinder that its wire lies under [N]."""
    found, points = {}, named_points(rig)
    for side, weight in dead_weights(case).items():
        body, (sign, _) = f"damper_{side}", SIDES[side]
        mesh = reduction.meshes[body]
        cylinder = mesh.nodes("cylinder")
        below = cylinder[mesh.points[cylinder, 2] < rig.damper_axis]
        place = points[body]["dead_weight"] + np.array([0.0, sign * weight.shift, 0.0])
        found[side] = reduction.assembly.load(body, distributed_load(mesh, below, _pull(weight), place))
    return found


def _pull(weight: DeadWeight) -> Float[NDArray[np.float64], "3"]:
    return weight.force * np.array([0.0, sin(weight.inclination), cos(weight.inclination)])


def _outputs(reduction: RigReduction) -> tuple[Output, ...]:
    """The tip, and how each damper moves against the blade where the differential laser looks."""
    assembly = reduction.assembly

    def row(body: str, name: str) -> Row:
        found = np.zeros(assembly.n_dof)
        found[assembly.rows(body, name, Y)] = 1.0
        return found

    found = [Output(name="tip", row=row("blade", "response"), quantity="displacement")]
    for side in SIDES:
        relative = row(f"damper_{side}", "laser_blade") - row("blade", f"laser_{side}")
        found.append(Output(name=f"damper {side} against blade", row=relative, quantity="displacement"))
    return tuple(found)


def _curves(sweep: RigSweepTable, rest: StaticState, bodies: Joined) -> tuple[Curve, ...]:
    """Each level with each history; the first history is that of the dead weights alone."""
    generator = np.random.default_rng(sweep.seed)
    histories = [rest.slider]
    for _ in range(sweep.histories - 1):
        shares = {line: generator.uniform(-HISTORY, HISTORY) for line in bodies.lines}
        histories.append(_pushed(rest, {name: shares[line] for line, names in bodies.lines.items() for name in names}))
    return tuple(
        Curve(
            parameter="frequency",
            first=2 * pi * sweep.first,
            last=2 * pi * sweep.last,
            fixed=level,
            step=None if sweep.step is None else 2 * pi * sweep.step,
            label=f"{level:g} N" + (f", history {number}" if sweep.histories > 1 else ""),
            slider=slider,
        )
        for level in sweep.levels
        for number, slider in enumerate(histories, start=1)
    )


def _pushed(rest: StaticState, share: dict[str, float]) -> Row:
    """Sliders after a damper was pushed along its line: each contact keeps a share of its limit at rest."""
    found = []
    for each in rest.contacts:
        first = -share[each.name] * (each.limit_at_rest / each.tangential_stiffness)
        found.append(np.array([first, *[0.0] * (len(each.tangents) - 1)]))
    return np.concatenate(found)
