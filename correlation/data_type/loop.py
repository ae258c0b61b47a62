"""Force-displacement loops: a joint on a test bench under an imposed displacement, or a contact line of a structure."""

import numpy as np

from correlation.campaign.measured_files import take_rows, without_padding
from correlation.campaign.measurement_unit import read_si_quantity
from correlation.campaign.signal_entry import read_signal
from correlation.campaign.toml_table import TomlTable
from correlation.data_type.loop_indication import list_loop_indications
from correlation.data_type.loop_prediction import predict_curve, predict_loop
from correlation.data_type.measured_loop import ForceLoop, compute_loop_features, describe_periods, length_unit
from correlation.data_type.registry import DATA_TYPES, DataContext, DataType, Motion, Panel
from correlation.model import Model
from correlation.signal.loop import analyse_loop

#: Zero of a displacement sensor: unrelated to the joint, which is usual, or the unloaded position of the joint.
ZEROS = ("unknown", "as measured")


def read_loop(table: TomlTable, context: DataContext) -> ForceLoop:
    """Read a ``[[loop]]`` of a manifest.

    Raises
    ------
    CampaignError
        A key or value cannot be used, or the record has no settled period.
    """
    columns = table.table("columns")
    displacement, force = read_signal(columns, "displacement"), read_signal(columns, "force")
    columns.finish()
    names = [*displacement.columns.values(), *force.columns.values()]
    file = take_rows(table, context.files.read(table.take("file", str)), names)
    file = without_padding(file, names)
    x, f = displacement.real_values(file, "m"), force.real_values(file, "N")
    place, line = table.take("place", str, None), table.take("line", str, None)
    if (place is None) == (line is None):
        wanted = 'give place = "..." whose displacement is imposed, or line = "..." of a vibrating structure'
        raise table.problem("place", wanted, show=False)
    zero = table.choice("zero", ZEROS) if "zero" in table.values else ZEROS[0]
    with table.reading(file.path.name):
        loops = analyse_loop(x, f)
        middle = loops.middle if place is not None and zero == ZEROS[0] else 0.0
        if middle:
            x = x - middle
            loops = analyse_loop(x, f)
    if not loops.plateaus:
        raise table.problem(
            "file",
            "has no two consecutive periods of equal amplitude, and no closed period: a loop must settle; record "
            "longer",
        )
    level = None
    if line is not None:
        si = context.units.level_si
        level = table.converted("level", lambda value: read_si_quantity(value, si), example=f"5 {si}".rstrip())
    loop = ForceLoop(
        name=table.take("name", str),
        displacement=x,
        force=f,
        loops=loops,
        frequency=table.converted("frequency", lambda value: read_si_quantity(value, "Hz"), example="0.5 Hz"),
        place=place,
        line=line,
        sensor=table.choice("sensor", [sensor.name for sensor in context.sensors]) if line is not None else None,
        level=level,
        held_out=table.take("held_out", bool, False),
        removed_middle=middle,
    )
    table.finish()
    if not loop.frequency > 0:
        raise table.problem("frequency", "must be above zero")
    return loop


def list_loop_motions(model: Model, loop: ForceLoop) -> list[Motion]:
    """Row of the place with the imposed displacement, and half the range of the displacement."""
    row = None if loop.place is None else model.places.get(loop.place)
    return [] if row is None else [(row, float(np.ptp(loop.displacement)) / 2)]


def make_loop_panels(model: Model, loop: ForceLoop) -> list[Panel]:
    """Panel with a settled period of each plateau and the loop of the model."""
    measured, predicted = [], []
    unit, factor = length_unit(max(plateau.amplitude[0] for plateau in loop.loops.plateaus))
    for plateau in loop.loops.plateaus:
        samples = loop.loops.samples((plateau.first + plateau.last) // 2)
        measured.append((factor * loop.displacement[samples], loop.force[samples]))
        curve = predict_curve(model, loop, plateau)
        if curve is not None:
            x, f = (np.append(signal, signal[0]) for signal in curve)
            predicted.append((factor * x, f))
    return [
        Panel(
            title=loop.name,
            x_label=f"displacement [{unit}]",
            y_label="force [N]",
            measured=tuple(measured),
            predicted=tuple(predicted),
            is_curve=True,
        )
    ]


DATA_TYPES.register(
    DataType(
        name=ForceLoop.type,
        table="loop",
        holds="force-displacement loops over time",
        read=read_loop,
        features=compute_loop_features,
        predict=predict_loop,
        states=None,
        panels=make_loop_panels,
        indications=list_loop_indications,
        motions=list_loop_motions,
        coverage=describe_periods,
    )
)
