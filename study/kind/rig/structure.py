"""A rig as a test case, so that `stickslip compare` and `stickslip diagnose` take it beside measurements.

The case says what the rig is at rest under its dead weights: pre-loads and gaps that are left at every station. Without
contacts nothing would hold the dampers; they hang on soft springs then, as in any modal test of a free body.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from math import pi
from zipfile import ZIP_DEFLATED

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from geometry.rig import SIDES, Rig
from reduction.file.npz import write_npz
from reduction.jointed_system import FrictionContact
from reduction.stuck import stuck_damping
from study.kind.rig.contact import dead_weights
from study.kind.rig.reduction import RigReduction
from study.kind.rig.system import RestingRig, Row, Y, excitation, resting_rig
from study.kind.rig.table import RigCase

#: Frequency at which a damper without contacts hangs on its soft springs [Hz]: far below all that is measured.
SUSPENSION = 20.0
#: Highest harmonic that the case keeps.
HIGHEST = 5


@dataclass(frozen=True, kw_only=True)
class RigTestFiles:
    """A test case and its structure.

    Parameters
    ----------
    case
        Text of the TOML file.
    arrays
        Bytes of the ``.npz`` file.
    """

    case: str
    arrays: bytes


def rig_test_case(case: RigCase, rig: Rig, reduction: RigReduction, stem: str) -> RigTestFiles:
    """The test case of a rig.

    Parameters
    ----------
    case
        As `load_case` returned it.
    rig
        Its dimensions.
    reduction
        Its bodies.
    stem
        Name of the ``.npz`` file without its suffix.

    Raises
    ------
    CaseError
        A damper that nothing holds, leaves its groove or finds no rest.
    """
    resting = resting_rig(case, rig, reduction)
    places = measured_places(reduction)
    lines = {
        name: [each for each in resting.rest.contacts if each.name in members]
        for name, members in resting.joined.lines.items()
    }
    parts, mass, hung = _parts(reduction, resting), resting.joined.mass, hanging(reduction)
    stiffness, stuck = resting.joined.stiffness + hung, resting.joined.stuck + hung
    arrays: dict[str, np.ndarray] = {
        "M": mass,
        "C": stuck_damping(mass, stiffness, stuck, case.damping.ratio, seen=excitation(reduction)),
        "K": stiffness,
        **_dofs(reduction),
        **places,
    }
    for name, (own_mass, own_stiffness) in parts.items():
        arrays |= {f"part_{name}_mass": own_mass, f"part_{name}_stiffness": own_stiffness}
    for name, contacts in lines.items():
        arrays[f"{name}_normal"] = np.array([each.normal for each in contacts])
        arrays[f"{name}_tangent"] = np.array([each.tangents[0] for each in contacts])
        if len(contacts[0].tangents) > 1:
            arrays[f"{name}_second_tangent"] = np.array([each.tangents[1] for each in contacts])
    arrays["at_rest"] = resting.rest.load
    arrays |= {f"{side}_dead_weight": pull for side, pull in resting.pull.items()}
    whole = BytesIO()
    write_npz(whole, arrays, ZIP_DEFLATED)
    return RigTestFiles(case=_text(case, stem, places, lines), arrays=whole.getvalue())


def measured_places(reduction: RigReduction) -> dict[str, Row]:
    """Where the tests of the rig measure, and so where an effect may act: motions along y."""
    assembly = reduction.assembly

    def row(body: str, name: str) -> Row:
        found = np.zeros(assembly.n_dof)
        found[assembly.rows(body, name, Y)] = 1.0
        return found

    found = {
        "tip": row("blade", "response"),
        "excitation": row("blade", "excitation"),
        "slot": (row("blade", "laser_left") + row("blade", "laser_right")) / 2,
    }
    return found | {f"damper_{side}": row(f"damper_{side}", "laser_blade") for side in SIDES}


def _parts(
    reduction: RigReduction, resting: RestingRig
) -> dict[str, tuple[Float[NDArray[np.float64], "r r"], Float[NDArray[np.float64], "r r"]]]:
    """Mass and stiffness of each body, of the springs that hold the second tangents, and of the soft suspension."""
    assembly, n = reduction.assembly, reduction.assembly.n_dof
    found = {}
    for body in assembly.bodies:
        mass, stiffness, own = np.zeros((n, n)), np.zeros((n, n)), assembly.columns(body)
        mass[own, own], stiffness[own, own] = assembly.mass[own, own], assembly.stiffness[own, own]
        found[body] = mass, stiffness
    found["suspension"] = np.zeros((n, n)), hanging(reduction)
    held = resting.joined.stiffness - resting.joined.bodies
    if held.any():
        found["second_tangents"] = np.zeros((n, n)), held
    return found


def hanging(reduction: RigReduction) -> Float[NDArray[np.float64], "r r"]:
    """Springs that the dampers hang on, shape (r, r) [N/m]: all their motions as rigid bodies have `SUSPENSION`."""
    assembly = reduction.assembly
    found = np.zeros((assembly.n_dof, assembly.n_dof))
    for body in (f"damper_{side}" for side in SIDES):
        own = assembly.columns(body)
        found[own, own] = (2 * pi * SUSPENSION) ** 2 * assembly.mass[own, own]
    return found


def _dofs(reduction: RigReduction) -> dict[str, np.ndarray]:
    """Body, node, direction and coordinates of each coordinate; modal ones are no motion of a point."""
    bodies, nodes, directions, coordinates = [], [], [], []
    for body, rom in reduction.assembly.bodies.items():
        b, r = rom.n_boundary, rom.n_dof
        bodies += [body] * r
        nodes += [*map(int, rom.boundary_node), *[0] * (r - b)]
        directions += [*("xyz"[int(axis)] for axis in rom.boundary_direction), *["modal"] * (r - b)]
        coordinates += [*reduction.places(body)[rom.boundary_node], *np.full((r - b, 3), np.nan)]
    return {
        "dof_body": np.array(bodies),
        "dof_node": np.array(nodes),
        "dof_direction": np.array(directions),
        "dof_coordinates": np.array(coordinates),
    }


def _text(case: RigCase, stem: str, places: Mapping[str, Row], lines: Mapping[str, list[FrictionContact]]) -> str:
    # A JSON string is a TOML string, whatever is in it.
    title, file = (json.dumps(each, ensure_ascii=False) for each in (case.title or "Rig", f"{stem}.npz"))
    tables = [
        "# A rig at rest under its dead weights, beside its tests: see docs/rig.md.\n"
        f"schema = 1\ntitle = {title}\n\n[model]\nfile = {file}\n"
    ]
    tables += [
        f'[[place]]\nname = "{name}"\nrow = "{name}"\n\n[[sensor]]\nname = "{name}"\nplace = "{name}"\n'
        for name in places
    ]
    for name, contacts in lines.items():
        second = f'second_tangent = {{ row = "{name}_second_tangent" }}\n' if len(contacts[0].tangents) > 1 else ""
        friction = f'friction = "{contacts[0].friction.value}"\n' if second else ""
        tables.append(
            f'[[line]]\nname = "{name}"\nnormal = {{ row = "{name}_normal" }}\ntangent = {{ row = "{name}_tangent" }}\n'
            f"{second}{friction}"
            f"normal_stiffness = {_each([1e-6 * each.normal_stiffness for each in contacts], 'N/um')}\n"
            f"tangential_stiffness = {_each([1e-6 * each.tangential_stiffness for each in contacts], 'N/um')}\n"
            f"friction_coefficient = {contacts[0].friction_coefficient:g}\n"
            f"preload = {_each([each.preload for each in contacts], 'N')}\n"
            f"gap = {_each([1e6 * each.gap for each in contacts], 'um')}\n"
        )
        for letter, component in (("T", "tangential"), ("N", "normal")):
            tables.append(f'[[line_sensor]]\nname = "{name}_{letter}"\nline = "{name}"\ncomponent = "{component}"\n')
    for side, weight in dead_weights(case).items():
        pressed = ", ".join(f'"{name}"' for name in lines if name.startswith(side))
        tables.append(
            f'[[dead_weight]] # the pre-loads are those under it\nname = "{side} dead weight"\n'
            f'row = "{side}_dead_weight"\nforce = "1 N" # of the row, which is that of {weight.force:g} N\n'
            f"presses = [{pressed}]\n"
        )
    tables.append(
        "[[static_load]] # what the contacts carry at rest, some of it along their tangents\n"
        'row = "at_rest"\nforce = "1 N" # of the row\n'
    )
    tables.append('[[load]] # 1 N; the level of a test scales it\nplace = "excitation"\n')
    tables.append(f"[harmonics]\nhighest = {HIGHEST}\n")
    return "\n".join(tables)


def _each(values: list[float], unit: str) -> str:
    return "[" + ", ".join(f'"{value:.9g} {unit}"' for value in values) + "]"
