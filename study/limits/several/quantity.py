"""Quantities of a run over everything: amplitudes of the sensors of motion, and forces of every contact line."""

from collections.abc import Iterator
from dataclasses import dataclass

from correlation.model import Sensor
from hbsolve.errors import BalanceError
from study.limits.model import choose_bounded_output, choose_output, find_contacts
from study.limits.result import name_quantity
from study.limits.table import LimitsTable
from study.solve.model import SolveModel
from study.solve.result import find_main_harmonic

#: Letters of a line's forces by direction, as in the reference paper; the number of the harmonic follows.
LETTERS = {"tangential": "T", "second tangential": "second T", "normal": "N"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Quantity:
    """One quantity of many.

    Parameters
    ----------
    name
        Words for it, such as "displacement of tip"; no two have the same.
    table
        [limits] of a case that asks for this quantity alone.
    output
        Sensor whose amplitude it is; None for forces.
    harmonic
        The one of amplitudes and dynamic forces [-].
    """

    name: str
    table: LimitsTable
    output: Sensor | None
    harmonic: int

    @property
    def place(self) -> str:
        """Name of the sensor, or of the contact line."""
        return str(self.table.contact if self.output is None else self.output.name)

    @property
    def force(self) -> str:
        """Short name of a force such as "T0" or "N1"."""
        letter = LETTERS[self.table.direction or "tangential"]
        return f"{letter}{0 if self.table.objective == 'static force' else self.harmonic}"


def own_quantity(table: LimitsTable, model: SolveModel) -> Quantity:
    """The one quantity that a case asks for.

    Parameters
    ----------
    table
        Request of the case, of one objective.
    model
        Model of the case.

    Raises
    ------
    BalanceError
        A sensor that there is not.
    """
    output = choose_bounded_output(table, model.outputs)
    return Quantity(
        name=name_quantity(table, output, model.motion_of(output)),
        table=table if output is None else table.model_copy(update={"sensor": output.name}),
        output=output,
        harmonic=find_main_harmonic(model.system),
    )


def list_quantities(table: LimitsTable, model: SolveModel) -> tuple[Quantity, ...]:
    """Amplitudes first, then the static and dynamic forces of each line.

    Parameters
    ----------
    table
        Request of the case; its sensor and its contact, if given, are the only ones.
    model
        Model of the case.

    Raises
    ------
    BalanceError
        A sensor or contact that there is not, or two sensors of one name.
    """
    outputs = model.outputs if table.sensor is None else (choose_output(table, model.outputs),)
    harmonic = find_main_harmonic(model.system)
    result = [
        Quantity(
            name=name_quantity(table, output, model.motion_of(output)),
            table=table.model_copy(update={"objective": "amplitude", "sensor": output.name, "contact": None}),
            output=output,
            harmonic=harmonic,
        )
        for output in outputs
    ]
    result += [
        Quantity(name=name_quantity(own, None), table=own, output=None, harmonic=harmonic)
        for own in _list_forces(table, model)
    ]
    for number, item in enumerate(result):
        if any(item.name == other.name for other in result[:number]):
            raise BalanceError(f'two quantities are called "{item.name}": give sensors and contacts different names')
    return tuple(result)


def _list_forces(table: LimitsTable, model: SolveModel) -> Iterator[LimitsTable]:
    """Quantities of each force of each line; a contact without a line counts as one."""
    normal = {joint.name: joint.normal_direction for joint in model.system.joints}
    if table.contact is not None:
        chosen = {table.contact: find_contacts(table.contact, model)}
    else:
        in_a_line = {name for members in model.lines.values() for name in members}
        alone = {name: (name,) for name in normal if name not in in_a_line}
        chosen = {**model.lines, **alone}
    for line, members in chosen.items():
        # Of joints without a normal force there is no contact force.
        if any(normal[name] is None for name in members):
            continue
        n_tangent = min(int(normal[name] or 0) for name in members)
        for direction in [*list(LETTERS)[:n_tangent], "normal"]:
            for objective in ("static force", "dynamic force"):
                asked = {"objective": objective, "sensor": None, "contact": line, "direction": direction}
                yield table.model_copy(update=asked)
