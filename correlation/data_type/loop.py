r"""Force-displacement loops: a joint on a test bench under an imposed displacement, or a contact line of a structure.

Features of each plateau of settled periods are the work per cycle, the secant stiffness and the middle of the forces at
both ends of the stroke; of a contact line in a vibrating structure also the amplitude of its motion.

An imposed displacement is predicted by a grip: a spring of stiffness g, far stiffer than the structure, whose other end
moves by :math:`u = u_0 + A \cos \Omega t`. It pulls with :math:`g (u - p^T x)` at the place p: the measured force.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measured_files import take_rows
from correlation.campaign.measurement_unit import si_quantity
from correlation.campaign.signal_entry import read_signal
from correlation.campaign.toml_table import TomlTable
from correlation.configuration import Configuration
from correlation.data_type.indication import Indication
from correlation.data_type.registry import DATA_TYPES, DataContext, DataType, Features, Motion, Panel
from correlation.errors import CampaignError
from correlation.model import LineSensor, Model, Sensor
from correlation.signal.loop import Loops, Plateau, analyse_loop
from fe.blas_threads import on_one_blas_thread
from geometry.plain_number import plain
from geometry.read_only_array import freeze_fields
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import NoSteadyState
from hbsolve.steady_state import steady_state
from reduction.stuck import stick_at_rest

Signal = Float[NDArray[np.float64], " n"]
Numbers = Float[NDArray[np.float64], " m"]

#: Stiffness of a grip over that of the structure at its place: the displacement is right to the inverse.
GRIP = 1e5
#: Instants of a period at which a predicted loop is drawn.
INSTANTS = 512
#: Features of a plateau, with their units.
FEATURES = (
    ("work", "work per cycle", "J"),
    ("secant_stiffness", "secant stiffness", "N/m"),
    ("force_offset", "middle of the force", "N"),
)
#: Least standard deviation of a feature [-]: what a calibration of the two channels leaves.
LEAST = 0.01
#: Parts of a stroke that a displacement is read to.
SAMPLED = 200
#: Ratio of the largest to the smallest amplitude that tells how work grows, and of frequencies that are several.
WIDE, SEVERAL = 1.5, 1.01


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceLoop:
    """A measured force-displacement record.

    Parameters
    ----------
    name
        As in the manifest.
    displacement, force
        Signals, shape (n,) [m, N]. The force resists the displacement.
    loops
        Periods and plateaus of the record.
    frequency
        Of the cycles [Hz].
    place
        Named place of the model whose displacement is imposed; None for a contact line.
    line
        Contact line whose tangential force it is; None for an imposed displacement.
    sensor
        Sensor of the displacement of a contact line; None for an imposed displacement.
    level
        Level of the force that drives the structure of a contact line [N]; None for an imposed displacement.
    held_out
        Whether no calibration may see it.
    """

    type: ClassVar[str] = "force-displacement loop"
    name: str
    displacement: Signal
    force: Signal
    loops: Loops
    frequency: float
    place: str | None = None
    line: str | None = None
    sensor: str | None = None
    level: float | None = None
    held_out: bool = False

    def __post_init__(self) -> None:
        freeze_fields(self, "displacement", "force")

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of sensors of the campaign that it uses."""
        return () if self.sensor is None else (self.sensor,)

    @property
    def suspicions(self) -> tuple[str, ...]:
        """What looks wrong in the record, in words."""
        return self.loops.suspicions


def read_loop(table: TomlTable, context: DataContext) -> ForceLoop:
    """A ``[[loop]]`` of a manifest.

    Raises
    ------
    CampaignError
        A key or value that cannot be used, or a record without a settled period.
    """
    columns = table.table("columns")
    displacement, force = read_signal(columns, "displacement"), read_signal(columns, "force")
    columns.finish()
    names = [*displacement.columns.values(), *force.columns.values()]
    file = take_rows(table, context.files.read(table.take("file", str)), names)
    x, f = displacement.real_values(file, "m"), force.real_values(file, "N")
    with table.reading(file.path.name):
        loops = analyse_loop(x, f)
    if not loops.plateaus:
        raise table.problem("file", "has no two neighbouring periods of one amplitude: a loop must settle; record more")
    place, line = table.take("place", str, None), table.take("line", str, None)
    if (place is None) == (line is None):
        wanted = 'give place = "..." whose displacement is imposed, or line = "..." of a vibrating structure'
        raise table.problem("place", wanted, show=False)
    level = None
    if line is not None:
        level = table.converted("level", lambda value: si_quantity(value, context.units.level_si))
    loop = ForceLoop(
        name=table.take("name", str),
        displacement=x,
        force=f,
        loops=loops,
        frequency=table.converted("frequency", lambda value: si_quantity(value, "Hz")),
        place=place,
        line=line,
        sensor=table.choice("sensor", [sensor.name for sensor in context.sensors]) if line is not None else None,
        level=level,
        held_out=table.take("held_out", bool, False),
    )
    table.finish()
    if not loop.frequency > 0:
        raise table.problem("frequency", "must be above zero")
    return loop


def loop_features(loop: ForceLoop) -> Features:
    """Numbers of each plateau."""
    label: list[str] = []
    unit: list[str] = []
    value: list[float] = []
    deviation: list[float] = []
    for plateau in loop.loops.plateaus:
        unit_of, factor = length_unit(plateau.amplitude[0])
        at = f"at {factor * plateau.amplitude[0]:.4g} {unit_of}"
        rows = [(getattr(plateau, name), f"{words} {at}", si, scale) for (name, words, si), scale in
                zip(FEATURES, _scales(plateau), strict=True)]  # fmt: skip
        if loop.line is not None:
            rows.append((plateau.amplitude, "amplitude", "m", plateau.amplitude[0]))
        for (mean, scatter), words, si, scale in rows:
            label, unit = [*label, words], [*unit, si]
            value.append(mean)
            deviation.append(float(np.hypot(np.nan_to_num(scatter), LEAST * scale)))
    return Features(label=tuple(label), unit=tuple(unit), value=np.array(value), deviation=np.array(deviation))


def _scales(plateau: Plateau) -> tuple[float, float, float]:
    """Sizes that the features of a plateau are uncertain in proportion to: those of the loop as a whole."""
    force = abs(plateau.secant_stiffness[0]) * plateau.amplitude[0]
    work = np.pi * force * plateau.amplitude[0]  # of an ellipse as wide as the stroke and as high as the force
    return max(abs(plateau.work[0]), LEAST * work), abs(plateau.secant_stiffness[0]), force


@on_one_blas_thread
def predict_loop(model: Model, loop: ForceLoop) -> Numbers:
    """What the model's loops give, shape (m,); NaN where it has no steady state.

    Raises
    ------
    CampaignError
        The model lacks the place, the line or the sensor.
    """
    if loop.line is not None:
        curve = driven_loop(model, loop)
        rows = [*_numbers(curve), np.nan if curve is None else float(np.ptp(curve[0])) / 2]
        return np.array(rows * len(loop.loops.plateaus))
    return np.concatenate([_numbers(imposed_loop(model, loop, plateau)) for plateau in loop.loops.plateaus])


def list_loop_motions(model: Model, loop: ForceLoop) -> list[Motion]:
    """The row of the place that is moved, with half the range of its displacement."""
    row = None if loop.place is None else model.places.get(loop.place)
    return [] if row is None else [(row, float(np.ptp(loop.displacement)) / 2)]


def list_loop_indications(model: Model, loops: Sequence[ForceLoop], predicted: Sequence[Numbers]) -> list[Indication]:
    """Play, work per cycle, its growth with the amplitude, and secant stiffness of all loops together.

    Parameters
    ----------
    model
        A model.
    loops
        Loops.
    predicted
        What it predicts for the features of each.
    """
    measured = [loop_features(loop) for loop in loops]
    indications = []
    for kind, words in (("work", "work per cycle"), ("stiffness", "secant stiffness")):
        ratios, values, answers = [], [], []
        for features, numbers in zip(measured, predicted, strict=True):
            for row, label in enumerate(features.label):
                if label.startswith(words):
                    values.append(features.value[row])
                    answers.append(numbers[row])
                    ratios.append((features.value[row] - numbers[row]) / features.deviation[row])
        there = np.isfinite(ratios)
        if there.any():
            # All loops have the calibration of their channels in common: the mean is no better known than one.
            difference = float(np.mean(np.array(ratios)[there]))
            measured_range, predicted_range = (_range_in_words(np.array(each)[there]) for each in (values, answers))
            unit = "J" if kind == "work" else "N/m"
            indications.append(
                Indication(
                    quantity=words, kind=kind, difference=difference, measured=f"is {measured_range} {unit}",
                    predicted=f"{predicted_range} {unit}",
                )
            )  # fmt: skip
    indications += _indicate_growth(loops, predicted)
    dwell = np.array([loop.loops.dwell for loop in loops])
    if np.median(dwell):
        of_model = float(np.median([_predict_dwell(model, loop) for loop in loops]))
        stroke = float(np.median([2 * loop.loops.plateaus[-1].amplitude[0] for loop in loops]))
        least = stroke / SAMPLED / np.sqrt(len(loops))
        scatter = float(np.std(dwell, ddof=1) / np.sqrt(len(dwell))) if len(dwell) > 1 else 0.0
        unit, factor = length_unit(stroke)
        # The work of a cycle is done over the rest of the way, there and back.
        force = [
            loop.loops.plateaus[-1].work[0] / (2 * (2 * loop.loops.plateaus[-1].amplitude[0] - loop.loops.dwell))
            for loop in loops
        ]
        indications.append(
            Indication(
                quantity="force after a reversal", kind="play",
                difference=(float(np.median(dwell)) - of_model) / max(least, scatter),
                measured=f"stays near zero over {factor * float(np.median(dwell)):.2g} {unit}, and resists with "
                f"{plain(float(np.median(force)), 3)} N in the mean over the rest of the way",
                predicted=f"does so over {factor * of_model:.2g} {unit}",
            )
        )  # fmt: skip
    return indications


def _indicate_growth(loops: Sequence[ForceLoop], predicted: Sequence[Numbers]) -> list[Indication]:
    """Exponent of the work per cycle over the amplitude: 2 of a linear damper, about 1 of friction that slides.

    The frequency has an exponent of its own, if there are several. Nothing is said of a narrow range of amplitudes.
    """
    rows = []
    for loop, numbers in zip(loops, predicted, strict=True):
        per_plateau = len(numbers) // max(len(loop.loops.plateaus), 1)
        for number, plateau in enumerate(loop.loops.plateaus):
            works = plateau.work[0], float(numbers[per_plateau * number])
            if min(works) > 0 and np.isfinite(works).all():
                rows.append((plateau.amplitude[0], loop.frequency, *works))
    if not rows:
        return []
    amplitude, frequency, work, of_model = np.log(np.array(rows)).T
    columns = [np.ones(len(rows)), amplitude, *([frequency] if np.ptp(frequency) > np.log(SEVERAL) else [])]
    slopes = np.column_stack(columns)
    if len(rows) <= len(columns) or np.ptp(amplitude) < np.log(WIDE) or np.linalg.matrix_rank(slopes) < len(columns):
        return []
    inverse = np.linalg.inv(slopes.T @ slopes)
    measured, model = (inverse @ slopes.T @ each for each in (work, of_model))
    scatter = float(np.sum((work - slopes @ measured) ** 2)) / (len(rows) - len(columns))
    deviation = float(np.sqrt(max(scatter, LEAST**2) * inverse[1, 1]))
    return [
        Indication(
            quantity="work per cycle over the amplitude", kind="slow growth" if measured[1] < 1.5 else "growth",
            difference=float(measured[1] - model[1]) / deviation, measured=f"grows with its power {measured[1]:.2f}",
            predicted=f"with its power {model[1]:.2f}",
        )
    ]  # fmt: skip


def _range_in_words(numbers: Numbers) -> str:
    low, high = (plain(float(each), 3) for each in (numbers.min(), numbers.max()))
    return low if low == high else f"{low} to {high}"


def _predict_dwell(model: Model, loop: ForceLoop) -> float:
    """Displacement of a model's loop after a reversal without force [m]; 0 without a steady state."""
    plateau = loop.loops.plateaus[-1]
    curve = driven_loop(model, loop) if loop.line is not None else imposed_loop(model, loop, plateau)
    return 0.0 if curve is None else analyse_loop(*(np.tile(signal, 3) for signal in curve)).dwell


def imposed_loop(model: Model, loop: ForceLoop, plateau: Plateau) -> tuple[Signal, Signal] | None:
    """Displacement and force of one predicted period, shape (512,) each [m, N]; None without a steady state.

    Raises
    ------
    CampaignError
        The model has no such place.
    """
    if loop.place is None or loop.place not in model.places:
        listed = ", ".join(model.places) or "none"
        raise CampaignError(
            f'loop "{loop.name}": the model has no place "{loop.place}"; its places: {listed}. Correct the name, or '
            f'add a [[place]] with name = "{loop.place}" to the case'
        )
    row = model.places[loop.place]
    system = model.system
    stiff = stick_at_rest(system.stiffness, system.joints)
    grip = GRIP * float(row @ stiff @ row) / float(row @ row) ** 2
    omega = 2 * np.pi * loop.frequency
    force = np.zeros((2, system.n_dof), dtype=np.complex128)
    force[1] = grip * plateau.amplitude[0] * row
    gripped = model.with_system(
        stiffness=system.stiffness + grip * np.outer(row, row),
        static_load=system.static + grip * plateau.displacement_offset[0] * row,
        harmonic_force=force,
    ).system
    balance = HarmonicBalance(system=gripped, n_harmonic=model.n_harmonic, n_sample=model.n_sample)
    try:
        state = steady_state(balance, omega)
    except NoSteadyState:
        return None
    x = _signal(state.coefficients @ row)
    imposed = np.zeros(len(state.coefficients), dtype=np.complex128)
    imposed[:2] = plateau.displacement_offset[0], plateau.amplitude[0]
    return x, grip * (_signal(imposed) - x)


def driven_loop(model: Model, loop: ForceLoop) -> tuple[Signal, Signal] | None:
    """The same of a contact line in the structure under its loads.

    Raises
    ------
    CampaignError
        The model has no such line, or no such sensor of motion.
    """
    if loop.line not in model.lines:
        raise CampaignError(
            f'loop "{loop.name}": the model has no line "{loop.line}"; its lines: {", ".join(model.lines) or "none"}'
        )
    force = LineSensor(name=f"{loop.name}, force", line=str(loop.line), component="tangential")
    motion = next((item for item in model.sensors if item.name == loop.sensor), None)
    if not isinstance(motion, Sensor):
        raise CampaignError(
            f'loop "{loop.name}": the model has no sensor of motion "{loop.sensor}": add it to the case'
        )
    seen = Configuration.from_model(Model(**{**vars(model), "sensors": (motion, force)}), free=False, slider=None)
    assert loop.level is not None
    state = seen.solve(loop.level, loop.frequency, seen.slider, ())
    if state is None:
        return None
    harmonics = np.arange(model.n_harmonic)
    x = seen.read(state, np.full(len(harmonics), motion.name), harmonics)
    f = seen.read(state, np.full(len(harmonics), force.name), harmonics)
    members = model.lines[force.line]
    tangent = np.sum([joint.directions[0] for joint in model.system.joints if joint.name in members], axis=0)
    # A sensor may read the motion against the tangent: the force of a loop resists the motion that is read.
    turn = -1.0 if float(motion.gain * (motion.row @ tangent)) < 0 else 1.0
    return _signal(x), turn * _signal(f)


def loop_panels(model: Model, loop: ForceLoop) -> list[Panel]:
    """A settled period of each plateau beside the model's loop."""
    measured, predicted = [], []
    unit, factor = length_unit(max(plateau.amplitude[0] for plateau in loop.loops.plateaus))
    for plateau in loop.loops.plateaus:
        samples = loop.loops.samples((plateau.first + plateau.last) // 2)
        measured.append((factor * loop.displacement[samples], loop.force[samples]))
        curve = driven_loop(model, loop) if loop.line is not None else imposed_loop(model, loop, plateau)
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


def length_unit(amplitude: float) -> tuple[str, float]:
    """Unit that an amplitude is written in, and its factor from metres."""
    return ("mm", 1e3) if amplitude >= 1e-3 else ("um", 1e6)


def _signal(coefficients: NDArray[np.complex128]) -> Signal:
    """One period of x(t) = Re sum X_k e^{i k Omega t}, shape (512,)."""
    phase = 2 * np.pi * np.arange(INSTANTS)[:, None] / INSTANTS * np.arange(len(coefficients))
    return np.asarray((np.exp(1j * phase) @ coefficients).real)


def _numbers(curve: tuple[Signal, Signal] | None) -> list[float]:
    """Features of one predicted period, by the same reading as those that were measured."""
    if curve is None:
        return [np.nan] * len(FEATURES)
    x, f = (np.tile(signal, 3) for signal in curve)
    result = analyse_loop(x, f)
    return [float(getattr(result, name)[0]) for name, _, _ in FEATURES]


DATA_TYPES.register(
    DataType(
        name=ForceLoop.type,
        table="loop",
        holds="force-displacement loops over time",
        read=read_loop,
        features=loop_features,
        predict=predict_loop,
        states=None,
        panels=loop_panels,
        indications=list_loop_indications,
        motions=list_loop_motions,
    )
)
