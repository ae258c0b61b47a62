"""From the tables of a test case to a test model: structure, contacts, loads at 1 N, sensors."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from casefile.errors import CaseError
from casefile.mistakes import Mistakes
from casefile.table import located
from correlation.errors import ModelDefinitionError
from correlation.model import DeadWeight, LineSensor, Model, Sensor
from reduction.errors import JointError
from reduction.jointed_system import Friction, FrictionContact, Joint, JointedSystem
from study.case.damping import case_damping
from study.case.joint import contact_joints
from study.case.place import Whereabouts
from study.case.tables import LineTable, TestCase
from study.kind.plain.structure import TestStructure, load_test_structure

Row = NDArray[np.float64]


def model_of_case(case: TestCase, folder: Path) -> Model:
    """The model of a case.

    Parameters
    ----------
    case
        As `casefile.table.load_case` returned it.
    folder
        That of the case file, which the structure's file is relative to.

    Raises
    ------
    CaseError
        With every mistake.
    """
    mistakes = Mistakes(case)
    structure: TestStructure | None = None
    with mistakes.at("model"):
        structure = load_test_structure(folder / case.model.file, case.dof)
    if structure is None:
        raise CaseError(mistakes.problems)
    where = Whereabouts(structure=structure.matrices, dofs=structure.dofs, stored=structure.stored)
    _check_names(case, mistakes)
    for number, place in enumerate(case.place):
        with mistakes.at("place", number):
            # What stands at a place that is a mistake is no further one.
            where.places[place.name] = np.zeros(structure.matrices.n_dof)
            where.places[place.name] = where.row(place)
    joints: list[Joint] = []
    lines: dict[str, tuple[str, ...]] = {}
    static = np.zeros(structure.matrices.n_dof)
    for number, line in enumerate(case.line):
        with mistakes.at("line", number):
            contacts = _contacts(line, where)
            joints += contacts
            lines[line.name] = tuple(contact.name for contact in contacts)
            if line.balanced_preload:
                static += np.sum([contact.preload * contact.normal for contact in contacts], axis=0)
    for number in range(len(case.contact)):
        with mistakes.at("contact", number):
            joints += contact_joints(case, case.contact, number, structure.matrices)
    harmonic = _loads(case, where, static, mistakes)
    sensors = _sensors(case, where, mistakes)
    weights = _dead_weights(case, where, mistakes)
    together = _pressed_together(case, mistakes)
    mistakes.raise_if_any()
    matrices, damping = structure.matrices, structure.matrices.damping
    with mistakes.at("damping"):
        damping = _damping(case, structure, joints)
    mistakes.raise_if_any()
    with located(case):
        system = JointedSystem(
            mass=matrices.mass,
            damping=damping,
            stiffness=matrices.stiffness,
            joints=joints,
            static_load=static,
            harmonic_force=harmonic,
        )
        return Model(
            system=system,
            sensors=tuple(sensors),
            parts=structure.parts,
            dofs=structure.dofs,
            lines=lines,
            places=where.places,
            dead_weights=weights,
            pressed_together=together,
            n_harmonic=case.harmonics.highest + 1,
            n_sample=case.harmonics.samples or 0,
        )


def _check_names(case: TestCase, mistakes: Mistakes) -> None:
    names = {
        "place": [table.name for table in case.place],
        "line": [table.name for table in case.line],
        "dead_weight": [table.name for table in case.dead_weight],
        "sensor": [table.name for table in case.sensor],
        "line_sensor": [table.name for table in case.line_sensor],
    }
    for kinds in (("place",), ("line", "dead_weight"), ("sensor", "line_sensor")):
        taken: dict[str, str] = {}
        for kind in kinds:
            for number, name in enumerate(names[kind]):
                if name in taken:
                    with mistakes.at(kind, number):
                        raise ModelDefinitionError(f'name = "{name}" is taken by {taken[name]}: give each its own')
                taken[name] = f"{kind}[{number}]"


def _contacts(line: LineTable, where: Whereabouts) -> list[FrictionContact]:
    normals = where.all_rows(line.normal)
    tangents = [where.all_rows(line.tangent)]
    if line.second_tangent is not None:
        tangents.append(where.all_rows(line.second_tangent))
    n = len(normals)
    for name, rows in zip(("tangent", "second_tangent"), tangents, strict=False):
        if len(rows) != n:
            raise ModelDefinitionError(f"{name} has {len(rows)} rows, normal {n}: a contact needs one of each")
    if line.shares is not None and len(line.shares) != n:
        raise ModelDefinitionError(f"shares has {len(line.shares)} numbers for {n} contacts: give one for each")
    share = np.ones(n) if line.shares is None else np.array(line.shares) / sum(line.shares)

    def each(name: str) -> Row:
        values: Sequence[float] = getattr(line, name)
        if len(values) not in {1, n}:
            raise ModelDefinitionError(
                f"{name} has {len(values)} values for {n} contacts: give one for all, or one for each"
            )
        return np.broadcast_to(np.array(values, dtype=np.float64), n)

    numbers = zip(
        each("normal_stiffness") * share, each("tangential_stiffness") * share, each("friction_coefficient"),
        each("preload") * share, each("gap"), strict=True,
    )  # fmt: skip
    return [
        FrictionContact(
            name=f"{line.name}.{number + 1}",
            normal=normals[number],
            tangents=np.array([rows[number] for rows in tangents]),
            normal_stiffness=float(kn),
            tangential_stiffness=float(kt),
            friction_coefficient=float(mu),
            preload=float(preload),
            gap=float(gap),
            friction=Friction(line.friction),
        )
        for number, (kn, kt, mu, preload, gap) in enumerate(numbers)
    ]


def _loads(case: TestCase, where: Whereabouts, static: Row, mistakes: Mistakes) -> NDArray[np.complex128]:
    """Harmonic forces at 1 N; constant ones are added to `static`."""
    n = where.structure.n_dof
    harmonic = np.zeros((max(load.harmonic for load in case.load) + 1, n), dtype=np.complex128)
    for number, constant in enumerate(case.static_load):
        with mistakes.at("static_load", number):
            static += constant.force * where.row(constant)
    for number, load in enumerate(case.load):
        with mistakes.at("load", number):
            if load.harmonic > case.harmonics.highest:
                raise JointError(
                    f"harmonic = {load.harmonic} is not kept: harmonics.highest is {case.harmonics.highest}; raise it"
                )
            harmonic[load.harmonic] += load.amplitude * np.exp(1j * load.phase) * where.row(load)
    if not mistakes.problems and not harmonic.any():
        with mistakes.at("load", 0):
            raise JointError("amplitude: all harmonic loads cancel or are zero, so that nothing vibrates: give one")
    return harmonic


def _sensors(case: TestCase, where: Whereabouts, mistakes: Mistakes) -> list[Sensor | LineSensor]:
    sensors: list[Sensor | LineSensor] = []
    for number, table in enumerate(case.sensor):
        with mistakes.at("sensor", number):
            sensors.append(Sensor(name=table.name, row=where.row(table), quantity=table.quantity, gain=table.gain))
    lines = [line.name for line in case.line]
    for number, each in enumerate(case.line_sensor):
        with mistakes.at("line_sensor", number):
            if each.line not in lines:
                raise ModelDefinitionError(
                    f'line = "{each.line}" is none of the case: there are {", ".join(lines) or "none"}'
                )
            sensors.append(LineSensor(name=each.name, line=each.line, component=each.component, gain=each.gain))
    return sensors


def _dead_weights(case: TestCase, where: Whereabouts, mistakes: Mistakes) -> dict[str, DeadWeight]:
    found, lines = {}, [line.name for line in case.line]
    for number, table in enumerate(case.dead_weight):
        with mistakes.at("dead_weight", number):
            for line in table.presses:
                if line not in lines:
                    raise ModelDefinitionError(
                        f'presses: "{line}" is no line of the case: there are {", ".join(lines) or "none"}'
                    )
            found[table.name] = DeadWeight(row=table.force * where.row(table), lines=table.presses)
    return found


def _pressed_together(case: TestCase, mistakes: Mistakes) -> tuple[tuple[str, ...], ...]:
    """Lines by what presses them."""
    found: dict[str, list[str]] = {}
    weighed = {line: weight.name for weight in case.dead_weight for line in weight.presses}
    for number, line in enumerate(case.line):
        if line.pressed_by is not None:
            with mistakes.at("line", number):
                if line.name in weighed:
                    raise ModelDefinitionError(
                        f'pressed_by = "{line.pressed_by}": dead weight "{weighed[line.name]}" presses this line; '
                        "remove one of them"
                    )
                if line.pressed_by in {weight.name for weight in case.dead_weight}:
                    raise ModelDefinitionError(
                        f'pressed_by = "{line.pressed_by}" is a dead weight: list the line in its presses instead'
                    )
                found.setdefault(line.pressed_by, []).append(line.name)
    return tuple(tuple(lines) for lines in found.values())


def _damping(case: TestCase, structure: TestStructure, joints: Sequence[Joint]) -> NDArray[np.float64]:
    table, matrices = case.damping, structure.matrices
    if table is None:
        return matrices.damping
    by_ratio = table.by_ratio
    if by_ratio is not None:
        return case_damping(by_ratio, matrices, joints)
    if matrices.has_damping and not table.replace:
        raise JointError(
            "a file that holds damping of its own meets [damping]: add replace = true, or remove the table"
        )
    return np.asarray((table.mass_factor or 0.0) * matrices.mass + (table.stiffness_factor or 0.0) * matrices.stiffness)
