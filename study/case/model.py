"""The model of a case: joints, loads and sensors of its tables on the matrices of its structure."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from casefile.table import Mistakes, located
from correlation.errors import ModelDefinitionError
from correlation.model import AnySensor, DeadWeight, LineSensor, LoadCell, Model, Sensor
from reduction.base_excitation import LEVEL_POWER, BaseExcitation, BaseMotion
from reduction.errors import JointError
from reduction.joint_law.registry import LAWS, Joint
from reduction.jointed_system import Friction, FrictionContact, JointedSystem
from study.case.joint_table import DIRECTION, LineTable
from study.case.place import PlaceFinder
from study.case.sensor_table import LineSensorTable, LoadCellTable, MotionSensorTable
from study.case.structure import Structure
from study.case.tables import Case, StructureTable

Row = NDArray[np.float64]


def make_case_model(case: Case[StructureTable], structure: Structure) -> Model:
    """Make the nominal model of a case, without calibration and without added effects.

    Parameters
    ----------
    case
        Case returned by `casefile.table.load_case`.
    structure
        Structure that the table ``[structure]`` describes.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them.
    """
    mistakes = Mistakes(case)
    finder = PlaceFinder(
        matrices=structure.matrices, dofs=structure.dofs, stored=structure.stored, places=dict(structure.places)
    )
    _check_names(case, structure, mistakes)
    _find_places(case, finder, mistakes)
    joints, lines = list(structure.joints), dict(structure.lines)
    static = np.zeros(structure.matrices.n_dof) if structure.static_load is None else structure.static_load.copy()
    for number, line in enumerate(case.line):
        lines[line.name] = ()  # a reference to an invalid line is not reported as another mistake
        with mistakes.at("line", number):
            contacts = _make_contacts(line, finder)
            joints += contacts
            lines[line.name] = tuple(contact.name for contact in contacts)
            if line.balanced_preload:
                static += np.sum([contact.preload * contact.normal for contact in contacts], axis=0)
    of_tables = _make_joints_of_tables(case, finder, mistakes)
    of_lines = {name for members in lines.values() for name in members}
    alone = {item.name: [item] for item in joints if item.name not in of_lines}
    groups = {name: tuple(item.name for item in group) for name, group in (alone | of_tables).items()}
    joints += [joint for made in of_tables.values() for joint in made]
    harmonic = _make_loads(case, structure, finder, static, mistakes)
    base, level_power = (None, 0) if mistakes.problems else _make_base(case, structure, mistakes)
    if base is not None:
        harmonic[: len(base[0])] += base[0]
    _refuse_no_load(case, harmonic, mistakes)
    sensors = _make_sensors(case, structure, finder, lines, mistakes)
    weights = _make_dead_weights(case, structure, finder, lines, mistakes)
    together = _group_pressed_lines(case, mistakes)
    mistakes.raise_if_any()
    damping = structure.matrices.damping
    if structure.damped is not None:
        with mistakes.at("structure", "damping"):
            damping = structure.damped(joints)
    mistakes.raise_if_any()
    with located(case, "structure"):
        system = JointedSystem(
            mass=structure.matrices.mass,
            damping=damping,
            stiffness=structure.matrices.stiffness,
            joints=joints,
            static_load=static,
            harmonic_force=harmonic,
            structural_damping=structure.loss_factor * structure.matrices.stiffness if structure.loss_factor else None,
        )
    with located(case):
        return Model(
            system=system,
            sensors=tuple(sensors),
            parts=structure.parts,
            dofs=structure.dofs,
            lines=lines,
            joint_groups=groups,
            places=finder.places,
            load_cells=structure.load_cells,
            dead_weights=weights,
            elastic_bodies=structure.elastic_bodies,
            linked_preloads=together,
            suspension=structure.suspension,
            base_acceleration=None if base is None else base[1],
            level_power=level_power,
            n_harmonic=case.harmonics.highest + 1,
            n_sample=case.harmonics.n_sample,
        )


def _check_names(case: Case[StructureTable], structure: Structure, mistakes: Mistakes) -> None:
    own = {
        "place": structure.places,
        "line": structure.lines,
        "dead_weight": structure.dead_weights,
        "sensor": (),
        "joint": [joint.name for joint in structure.joints],
    }
    for tables in (("place",), ("line", "dead_weight"), ("sensor",), ("joint",)):
        taken = {name: f"{table} of the structure" for table in tables for name in own[table]}
        for table in tables:
            for number, entry in enumerate(getattr(case, table)):
                if entry.name in taken:
                    with mistakes.at(table, number):
                        raise ModelDefinitionError(
                            f'name = "{entry.name}" is already used by {taken[entry.name]}: give each a different name'
                        )
                taken[entry.name] = f"{table}[{number}]"


def _find_places(case: Case[StructureTable], finder: PlaceFinder, mistakes: Mistakes) -> None:
    for number, place in enumerate(case.place):
        with mistakes.at("place", number):
            # A reference to an invalid place is not reported as another mistake.
            finder.places[place.name] = np.zeros(finder.matrices.n_dof)
            finder.places[place.name] = finder.row(place)


def _make_contacts(line: LineTable, finder: PlaceFinder) -> list[FrictionContact]:
    normals = finder.all_rows(line.normal)
    tangents = [finder.all_rows(line.tangent)]
    if line.second_tangent is not None:
        tangents.append(finder.all_rows(line.second_tangent))
    n = len(normals)
    for name, rows in zip(("tangent", "second_tangent"), tangents, strict=False):
        if len(rows) != n:
            raise ModelDefinitionError(f"{name} has {len(rows)} rows, normal {n}: a contact needs one row of each")
    if line.shares is not None and len(line.shares) != n:
        raise ModelDefinitionError(f"shares has {len(line.shares)} numbers for {n} contacts: give one for each")
    share = np.ones(n) if line.shares is None else np.array(line.shares) / sum(line.shares)

    def item(name: str) -> Row:
        values: Sequence[float] = getattr(line, name)
        if len(values) not in {1, n}:
            raise ModelDefinitionError(
                f"{name} has {len(values)} values for {n} contacts: give one for all, or one for each"
            )
        return np.broadcast_to(np.array(values, dtype=np.float64), n)

    numbers = zip(
        item("normal_stiffness") * share, item("tangential_stiffness") * share, item("friction_coefficient"),
        item("preload") * share, item("gap"), strict=True,
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


def _make_loads(
    case: Case[StructureTable], structure: Structure, finder: PlaceFinder, static: Row, mistakes: Mistakes
) -> NDArray[np.complex128]:
    """Make the harmonic forces at level 1, those of the case if it has any; constant forces are added to `static`."""
    for number, constant in enumerate(case.static_load):
        with mistakes.at("static_load", number):
            static += constant.force * finder.row(constant)
    if not case.load:
        none = np.zeros((2, finder.matrices.n_dof), dtype=np.complex128)
        return none if structure.harmonic_force is None else structure.harmonic_force
    highest = case.harmonics.highest
    harmonic = np.zeros((max(load.harmonic for load in case.load) + 1, finder.matrices.n_dof), dtype=np.complex128)
    for number, load in enumerate(case.load):
        with mistakes.at("load", number):
            if load.harmonic > highest:
                loses = "keeps only the mean and drops" if highest == 0 else "drops"
                raise JointError(
                    f"harmonic = {load.harmonic}: harmonics.highest = {highest} {loses} this load; take at least "
                    f"{load.harmonic}; friction needs 5 or more"
                )
            if load.base is not None:
                continue
            harmonic[load.harmonic] += load.amplitude * np.exp(1j * load.phase) * finder.row(load)
    return harmonic


def _refuse_no_load(case: Case[StructureTable], harmonic: NDArray[np.complex128], mistakes: Mistakes) -> None:
    if case.load and not mistakes.problems and not harmonic.any():
        with mistakes.at("load", 0):
            raise JointError(
                "amplitude: all harmonic loads cancel or are zero, so nothing vibrates: give a nonzero load"
            )


def _make_base(
    case: Case[StructureTable], structure: Structure, mistakes: Mistakes
) -> tuple[tuple[NDArray[np.complex128], NDArray[np.complex128]] | None, int]:
    """Inertia load and acceleration of all bases at level 1, shape (n, r), and the power of Omega in the level."""
    tables = [(number, load) for number, load in enumerate(case.load) if load.base is not None]
    if not tables:
        return None, 0
    shape = (max(load.harmonic for _, load in tables) + 1, structure.matrices.n_dof)
    force, acceleration = np.zeros((2, *shape), dtype=np.complex128)
    for number, load in tables:
        with mistakes.at("load", number):
            assert load.base is not None
            quantity, amplitude = load.base_quantity
            coefficients = np.zeros(load.harmonic + 1, dtype=np.complex128)
            coefficients[-1] = amplitude * np.exp(1j * load.phase)
            motion = find_base_motion(structure, load.base)
            own = BaseExcitation(base=motion, amplitude=coefficients, quantity=quantity)
            force[: len(coefficients)] += own.force
            acceleration[: len(coefficients)] += own.acceleration
    powers = {LEVEL_POWER[load.base_quantity[0]] for _, load in tables} | (
        {0} if len(tables) < len(case.load) else set()
    )
    if len(powers) > 1:
        with mistakes.at("load", tables[0][0]):
            raise JointError(
                "the ratio of the loads would change with frequency: together with a force, or with the acceleration "
                "of another base, give the acceleration of every base"
            )
    return (force, acceleration), max(powers)


def find_base_motion(structure: Structure, base: str | tuple[float, ...]) -> BaseMotion:
    """Find the motion of each degree of freedom with a base that moves by 1.

    Parameters
    ----------
    structure
        Structure whose fixed supports are the base.
    base
        Axis, or the motion of each degree of freedom.

    Raises
    ------
    JointError
        A motion of the wrong length, or degrees of freedom whose motion along an axis is unknown.
    """
    n = structure.matrices.n_dof
    if not isinstance(base, str):
        if len(base) != n:
            raise JointError(f"base has {len(base)} numbers for {n} degrees of freedom: give one for each")
        return BaseMotion.of(structure.matrices.mass, np.array(base, dtype=np.float64))
    if structure.base is not None:
        return structure.base(base)
    unknown = not structure.dofs or any(dof.direction == "modal" for dof in structure.dofs)
    if unknown:
        raise JointError(
            f'base = "{base}": the inertia load of a base needs the mass of every degree of freedom along an axis, '
            'which this structure does not contain: describe it as a part, a blade or kind = "matrices" with a table '
            "of degrees of freedom; or, for matrices that you have reduced by x = T q, give base as the list M_r^-1 "
            "T^T M r, with the motion r of all degrees of freedom with the base"
        )
    row = np.array([float(dof.direction == base) for dof in structure.dofs])
    if not row.any():
        raise JointError(f'base = "{base}": no degree of freedom moves along {base}: give another axis')
    return BaseMotion.of(structure.matrices.mass, row)


def _make_sensors(
    case: Case[StructureTable],
    structure: Structure,
    finder: PlaceFinder,
    lines: dict[str, tuple[str, ...]],
    mistakes: Mistakes,
) -> list[AnySensor]:
    if not case.sensor:
        return list(structure.sensors)
    sensors: list[AnySensor] = []
    for number, table in enumerate(case.sensor):
        with mistakes.at("sensor", number):
            if isinstance(table, MotionSensorTable):
                sensors.append(Sensor(
                        name=table.name, row=finder.row(table), quantity=table.quantity, gain=table.gain,
                        relative=table.relative,
                    )
                )  # fmt: skip
            elif isinstance(table, LoadCellTable):
                sensors.append(_make_load_cell(table, structure))
            else:
                sensors.append(_make_line_sensor(table, lines))
    return sensors


def _make_load_cell(table: LoadCellTable, structure: Structure) -> LoadCell:
    if table.cell not in structure.load_cells:
        raise ModelDefinitionError(
            f'cell = "{table.cell}" is not a load cell of the structure: it has '
            f"{', '.join(structure.load_cells) or 'none'}"
        )
    return replace(structure.load_cells[table.cell], name=table.name, gain=table.gain)


def _make_line_sensor(table: LineSensorTable, lines: dict[str, tuple[str, ...]]) -> LineSensor:
    if table.line not in lines:
        raise ModelDefinitionError(f'line = "{table.line}" is not in the case: there are {", ".join(lines) or "none"}')
    return LineSensor(name=table.name, line=table.line, component=table.component, gain=table.gain)


def _make_dead_weights(
    case: Case[StructureTable],
    structure: Structure,
    finder: PlaceFinder,
    lines: dict[str, tuple[str, ...]],
    mistakes: Mistakes,
) -> dict[str, DeadWeight]:
    result = dict(structure.dead_weights)
    for number, table in enumerate(case.dead_weight):
        with mistakes.at("dead_weight", number):
            for line in table.presses:
                if line not in lines:
                    raise ModelDefinitionError(
                        f'presses: "{line}" is not a line of the case: there are {", ".join(lines) or "none"}'
                    )
            result[table.name] = DeadWeight(row=table.force * finder.row(table), lines=table.presses)
    return result


def _group_pressed_lines(case: Case[StructureTable], mistakes: Mistakes) -> tuple[tuple[str, ...], ...]:
    """Group the contact lines that the same part presses (``pressed_by``)."""
    result: dict[str, list[str]] = {}
    pressing = {line: weight.name for weight in case.dead_weight for line in weight.presses}
    for number, line in enumerate(case.line):
        if line.pressed_by is not None:
            with mistakes.at("line", number):
                if line.name in pressing:
                    raise ModelDefinitionError(
                        f'pressed_by = "{line.pressed_by}": dead weight "{pressing[line.name]}" presses this line; '
                        "remove one of them"
                    )
                if line.pressed_by in {weight.name for weight in case.dead_weight}:
                    raise ModelDefinitionError(
                        f'pressed_by = "{line.pressed_by}" is a dead weight: list the line in its presses instead'
                    )
                result.setdefault(line.pressed_by, []).append(line.name)
    return tuple(tuple(lines) for lines in result.values())


def _make_joints_of_tables(
    case: Case[StructureTable], finder: PlaceFinder, mistakes: Mistakes
) -> dict[str, list[Joint]]:
    """Make the joints of each valid table ``[[joint]]``, by its name."""
    result: dict[str, list[Joint]] = {}
    for number, table in enumerate(case.joint):
        with mistakes.at("joint", number):
            result[table.name] = make_joints(case, number, finder)
    return result


def make_joints(case: Case[StructureTable], number: int, finder: PlaceFinder) -> list[Joint]:
    """Make the joints of one table ``[[joint]]``.

    Parameters
    ----------
    case
        Case with the table, for file and line of a mistake.
    number
        Index of the table.
    finder
        Finder of places.

    Raises
    ------
    JointError
        Places with different numbers of stations, or parameters that the law refuses.
    """
    table = case.joint[number]
    law = LAWS[table.kind]
    rows = {}
    for label in law.places:
        place = table if label == DIRECTION else getattr(table, label)
        if place is not None:
            with located(case, "joint", number, *(() if label == DIRECTION else (label,))):
                rows[label] = finder.rows(place)
    counts = {len(item) for item in rows.values()}
    if len(counts) > 1:
        listed = ", ".join(f"{label} {len(item)}" for label, item in rows.items())
        raise JointError(
            f"its places have different numbers of stations ({listed}): a contact needs one station of each"
        )
    keys = [*(item.name for item in law.parameters), *(item.name for item in law.options)]
    values = {key: getattr(table, key) for key in keys}
    count = counts.pop()
    names = [table.name] if count == 1 else [f"{table.name} {station}" for station in range(count)]
    return [
        law.build(name, {label: item[station] for label, item in rows.items()}, values)
        for station, name in enumerate(names)
    ]
