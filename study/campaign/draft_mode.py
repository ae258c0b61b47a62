"""Drafts of natural modes from shapes and tables in measured files."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

from correlation.file.column import MeasuredFile, MeasuredShape, Node
from study.campaign.column_role import Role
from study.campaign.draft import ManifestDraft, Note, without_marks
from study.campaign.draft_frequency import ask_configuration
from study.campaign.question import Marked
from study.campaign.sensor_draft import AXES, draft_position
from study.campaign.table import make_file_stem
from study.campaign.table_kind import HERTZ, JudgedTable, get_value

MODES = {"normal mode", "complex mode"}
#: Largest damping ratio of a mode; a column with larger values is probably in percent [-].
MOST_DAMPED = 0.3
#: End of a name that states that the values have no unit.
WITHOUT_UNIT = re.compile(r"[\[(] *[-1] *[\])]$")
#: Number of translational axes; further axes are rotations.
MOTIONS = 3
#: Readings of a shape, by the name of the sensor: node, axis and value.
Readings = dict[str, tuple[int, str, complex]]


def draft_modes(draft: ManifestDraft, files: Mapping[str, MeasuredFile]) -> None:
    """Draft one mode per shape with a natural frequency; other shapes are left out with the reason.

    Parameters
    ----------
    draft
        Draft, extended in place.
    files
        Measured files by their names; nodes and shapes may be in different files.
    """
    nodes = {number: node for file in files.values() for number, node in file.nodes.items()}
    for name, file in files.items():
        reasons = [_describe_unusable(shape) for shape in file.shapes]
        pairs = [*zip(file.shapes, reasons, strict=True)]
        draft.left_out += [f"{name}, {shape.where}: {reason}" for shape, reason in pairs if reason]
        modes = [shape for shape, reason in pairs if not reason]
        taken: set[str] = set()
        for number, shape in enumerate(modes, start=1):
            called = _make_unique(f"{make_file_stem(name)} {shape.facts.get('mode', number)}", taken)
            draft.entries["mode"].append(_draft_mode(draft, file, shape, called, {**nodes, **file.nodes}))
        if modes:
            result = [shape.frequency for shape in modes]
            why = f"shapes with natural frequencies from {min(result):.4g} to {max(result):.4g} Hz"
            draft.notes.append(Note(file=name, columns=f"{len(modes)} shapes", role="modes", unit="", evidence=why))


def draft_mode_table(draft: ManifestDraft, judged: JudgedTable) -> None:
    """Draft one mode without a shape per row of a table of natural frequencies.

    Parameters
    ----------
    draft
        Draft, extended in place.
    judged
        Table.
    """
    file, label = judged.table.file.path.name, judged.table.label
    frequency = judged.of_role(Role.FREQUENCY)[0]
    guess = judged.columns[frequency.name]
    hertz = HERTZ.get(guess.unit, 1.0) * frequency.values
    configuration = ask_configuration(draft, label)
    damping, why = _read_damping_ratios(draft, judged)
    named = sorted(judged.of_role(Role.MODE), key=lambda column: not column.words)
    taken = {str(entry["name"]) for entry in draft.entries["mode"]}
    for row, value in enumerate(hertz.tolist()):
        number = get_value(named[0], row) if named else row + 1
        called = number if isinstance(number, str) else f"{label} {number:g}"
        if not (np.isfinite(value) and value > 0):
            why_not = f"its natural frequency is {value:g} Hz: a [[mode]] needs one above zero"
            draft.left_out.append(f'{file}: the mode "{called}": {why_not}')
            continue
        entry: dict[str, Any] = {"name": _make_unique(called, taken), "configuration": configuration}
        shown = f"{value:.9g} Hz"
        entry["frequency"] = Marked(value=shown, assumed=guess.evidence) if guess.assumed else shown
        if damping[row] > 0:
            ratio = float(f"{damping[row]:.9g}")
            entry["damping"] = Marked(value=ratio, assumed=why) if why else ratio
        draft.entries["mode"].append(entry)


def _read_damping_ratios(draft: ManifestDraft, judged: JudgedTable) -> tuple[NDArray[np.float64], str]:
    """Damping ratios of the rows of a table [-], NaN without any, and the reason why their unit was assumed."""
    column = next(iter(judged.of_role(Role.DAMPING)), None)
    if column is None:
        return np.full(len(judged.table.columns[0].values), np.nan), ""
    if column.unit or WITHOUT_UNIT.search(column.name):
        return column.values / (100 if column.unit else 1), ""
    largest = float(np.nanmax(column.values))
    answer = draft.ask(
        f'Is "{column.name}" of {judged.table.file.path.name} a ratio, or in percent?',
        "percent" if largest > MOST_DAMPED else "ratio", f"no unit in the file, and it reaches {largest:g}",
        "ratio", "percent",
    )  # fmt: skip
    why = answer.assumed and f"a damping {'in percent' if answer.value == 'percent' else 'ratio'}: {answer.assumed}"
    return column.values / (100 if answer.value == "percent" else 1), why


def _describe_unusable(shape: MeasuredShape) -> str:
    """Reason why a shape is not a natural mode; empty if it is one."""
    if shape.kind not in MODES:
        return f"a shape of the kind {shape.kind} is not a natural mode"
    if not (np.isfinite(shape.frequency) and shape.frequency > 0):
        return f"its natural frequency is {shape.frequency:g} Hz: a comparison needs one above zero"
    return ""


def _make_unique(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "'"
    taken.add(name)
    return name


def _draft_mode(
    draft: ManifestDraft, file: MeasuredFile, shape: MeasuredShape, name: str, nodes: Mapping[int, Node]
) -> dict[str, Any]:
    """Entry of one mode."""
    entry: dict[str, Any] = {"name": name, "configuration": ask_configuration(draft, make_file_stem(file.path.name))}
    entry["frequency"] = f"{shape.frequency:.9g} Hz"
    if np.isfinite(shape.damping_ratio) and shape.damping_ratio > 0:
        entry["damping"] = float(f"{shape.damping_ratio:.9g}")
    where = f"{file.path.name}, {shape.where}"
    quantity, readings = _keep_one_quantity(draft, _draft_readings(draft, shape, where), where)
    if len(readings) < 2:
        draft.left_out.append(f"{where}: a comparison needs two moving points, and its shape has {len(readings)}")
        return entry
    for sensor, (node, axis, _) in readings.items():
        if draft.named("sensor", sensor) is None:
            which = f"the points of the shapes of {file.path.name}"
            position = draft_position(draft, which, axis, nodes.get(node))
            draft.entries["sensor"].append({"name": sensor, "quantity": quantity, **position})
    turned, share = _turn(np.array([value for *_, value in readings.values()]))
    values = {sensor: float(f"{value:.9g}") for sensor, value in zip(readings, turned.tolist(), strict=True)}
    why = f"the real part of the complex shape after a phase rotation; the imaginary part is {100 * share:.2g} % of it"
    return {**entry, "shape": Marked(value=values, assumed=why) if share > 0 else values}


def _draft_readings(draft: ManifestDraft, shape: MeasuredShape, where: str) -> Readings:
    """Displacements of a shape along the axes on which a point moves."""
    values = np.asarray(shape.values, dtype=np.complex128)
    moves = np.flatnonzero(np.nan_to_num(values).any(axis=0)).tolist()
    if any(axis >= MOTIONS for axis in moves):
        draft.left_out.append(f"{where}: rotations of its shape: only displacements are compared")
    return {
        f"{node}{AXES[axis].upper()}": (int(node), AXES[axis], complex(values[row, axis]))
        for row, node in enumerate(shape.nodes.tolist())
        for axis in moves
        if axis < MOTIONS and np.isfinite(values[row, axis])
    }


def _keep_one_quantity(draft: ManifestDraft, readings: Readings, where: str) -> tuple[str, Readings]:
    """Quantity of most existing sensors of a shape, and the readings without those of sensors of another quantity."""
    of = {
        sensor: str(without_marks(entry["quantity"])) for sensor in readings if (entry := draft.named("sensor", sensor))
    }
    main = max(of.values(), key=[*of.values()].count, default="displacement")
    if others := [sensor for sensor in of if of[sensor] != main]:
        listed = ", ".join(f'"{sensor}"' for sensor in others)
        draft.left_out.append(
            f"{where}: points {listed} of its shape, whose sensors do not measure {main} like the others"
        )
    return main, {sensor: reading for sensor, reading in readings.items() if sensor not in others}


def _turn(values: Complex[NDArray[np.complex128], " n"]) -> tuple[NDArray[np.float64], float]:
    """Real shape nearest to a complex one, shape (n,), and the norm of the imaginary rest relative to it [-]."""
    if not values.imag.any():
        return values.real, 0.0
    # The rotation exp(-i a) that minimises the imaginary part.
    real = values * np.exp(-0.5j * np.angle((values**2).sum()))
    size = float(np.linalg.norm(real.real))
    return real.real, float(np.linalg.norm(real.imag)) / size
