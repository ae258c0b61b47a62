"""Quantities of a search for all limits: amplitudes of the sensors of motion, and forces of all contact lines."""

from collections.abc import Iterator
from dataclasses import dataclass

from correlation.model import Sensor
from hbsolve.errors import BalanceError
from study.limits.model import choose_bounded_output, choose_output, find_contacts
from study.limits.result import name_quantity
from study.limits.table import LimitsTable
from study.solve.model import SolveModel
from study.solve.result import find_main_harmonic

#: Symbols of a line's forces by direction, as in the reference paper, before the number of the harmonic.
LETTERS = {"tangential": "T", "second tangential": "second T", "normal": "N"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Quantity:
    """A bounded quantity.

    Parameters
    ----------
    name
        Unique name, such as "displacement of tip".
    table
        Table [limits] for only this quantity.
    output
        Sensor whose amplitude is bounded; None for forces.
    harmonic
        Harmonic of amplitudes and dynamic forces [-].
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
        """Symbol of a force, such as "T0" or "N1"."""
        letter = LETTERS[self.table.direction or "tangential"]
        return f"{letter}{0 if self.table.objective == 'static force' else self.harmonic}"


def own_quantity(table: LimitsTable, model: SolveModel) -> Quantity:
    """Make the quantity of a case with one objective.

    Parameters
    ----------
    table
        Table [limits] of the case.
    model
        Model of the case.

    Raises
    ------
    BalanceError
        The sensor does not exist.
    """
    output = choose_bounded_output(table, model.outputs)
    return Quantity(
        name=name_quantity(table, output, model.motion_of(output)),
        table=table if output is None else table.model_copy(update={"sensor": output.name}),
        output=output,
        harmonic=find_main_harmonic(model.system),
    )


def list_quantities(table: LimitsTable, model: SolveModel) -> tuple[Quantity, ...]:
    """List the amplitudes, and then the static and dynamic forces of each line.

    Parameters
    ----------
    table
        Table [limits] of the case; if it gives a sensor or a contact, it is the only one.
    model
        Model of the case.

    Raises
    ------
    BalanceError
        A sensor or contact does not exist, or two quantities have the same name.
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
    """Yield the table for each force of each line; a contact without a line counts as a line."""
    normal = {joint.name: joint.normal_direction for joint in model.system.joints}
    if table.contact is not None:
        chosen = {table.contact: find_contacts(table.contact, model)}
    else:
        in_a_line = {name for members in model.lines.values() for name in members}
        alone = {name: (name,) for name in normal if name not in in_a_line}
        chosen = {**model.lines, **alone}
    for line, members in chosen.items():
        # Joints without a normal force have no contact force.
        if any(normal[name] is None for name in members):
            continue
        n_tangent = min(int(normal[name] or 0) for name in members)
        for direction in [*list(LETTERS)[:n_tangent], "normal"]:
            for objective in ("static force", "dynamic force"):
                asked = {"objective": objective, "sensor": None, "contact": line, "direction": direction}
                yield table.model_copy(update=asked)
