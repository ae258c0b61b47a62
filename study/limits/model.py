"""The search for limits of a case, with all inputs of the limits."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, pi
from typing import TypeAlias

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from casefile.table import CaseModel, located
from correlation.model import Sensor
from geometry.errors import ComputationFailed
from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError, NoSteadyState
from hbsolve.limits.loss_factor import LossFactor
from hbsolve.limits.objective import ContactForceHarmonic, Objective, OutputHarmonic
from hbsolve.limits.problem import LimitProblem
from hbsolve.limits.response_limits import limit_problem
from hbsolve.limits.search import LimitSettings
from reduction.jointed_system import JointedSystem
from study.case.sweep_table import ControlledSweepTable, FrequencySweepTable, LevelSweepTable
from study.limits.table import EVERYTHING, FORCES, MOST_POINTS, LimitsTable
from study.solve.frequency_range import warn_of_high_frequency
from study.solve.model import SolveModel
from study.solve.result import find_main_harmonic

Real = NDArray[np.float64]
Sweep: TypeAlias = FrequencySweepTable | LevelSweepTable | ControlledSweepTable | None
#: Number of intervals of a band without a step.
INTERVALS = 50
#: Indices of a contact's directions in `ContactForceHarmonic`.
DIRECTION = {"tangential": 0, "second tangential": 1, "normal": -1}


@dataclass(frozen=True, kw_only=True, eq=False)
class LimitSearch:
    """All inputs of a search for limits.

    Parameters
    ----------
    system
        System with its loads at level 1.
    harmonics, n_sample
        H, and samples per period, 0 for the solver's choice [-].
    objective
        Quantity whose limits are computed.
    harmonic
        Harmonic of amplitudes [-].
    base
        Acceleration of a moving base in this harmonic at level 1, which the reading of the output includes [m/s^2].
    row
        Row of the output whose amplitude is bounded, or for the loss factor reported at the limits, shape (r,); None
        for forces.
    angular_frequency, levels
        Frequencies and levels, ascending [rad/s, -].
    nominal
        Nominal slider positions, the centre of the box, shape (s,) [m]; None for rest under the static load.
    reach
        Reach w_max of the sliders [m]; None for the default.
    settings
        Effort of the search.
    """

    system: JointedSystem
    harmonics: int
    n_sample: int
    objective: Objective
    harmonic: int
    base: complex
    row: Float[Real, " r"] | None
    angular_frequency: tuple[float, ...]
    levels: tuple[float, ...]
    nominal: Float[Real, " s"] | None
    reach: float | None
    settings: LimitSettings

    def balance(self) -> HarmonicBalance:
        """Make the harmonic balance of the search."""
        return HarmonicBalance(system=self.system, n_harmonic=self.harmonics + 1, n_sample=self.n_sample)

    def problem(self) -> LimitProblem:
        """Make the problem of the search.

        Raises
        ------
        BalanceError
            See `limit_problem`.
        ComputationFailed
            There is no state of rest under the static load.
        """
        try:
            return limit_problem(self.balance(), self.objective, nominal=self.nominal, reach=self.reach)
        except NoSteadyState as error:
            raise ComputationFailed(f"limits: {error}") from error


def make_limit_search(
    case: CaseModel,
    table: LimitsTable,
    sweep: Sweep,
    model: SolveModel,
) -> LimitSearch:
    """Make the search for limits of a case.

    Parameters
    ----------
    case
        Case, for file and line of a mistake.
    table
        Table [limits] of the case.
    sweep
        Table [sweep] of the case, for keys that [limits] does not give; None if there is none.
    model
        Model of the case, whose state of rest is the nominal one by default.

    Raises
    ------
    CaseError
        An output, contact, frequency or level is missing, or limits cannot be computed for the joints of the case.
    """
    omega, levels = list_limit_points(case, table, sweep)
    warn_of_high_frequency(model.system, omega)
    if model.level_power:
        with located(case, "load", 0):
            raise BalanceError(
                "the response limits are searched for at levels of base acceleration: give the acceleration of the "
                "base instead of its velocity or displacement"
            )
    with located(case, "limits"):
        if table.objective == EVERYTHING:
            raise BalanceError(
                'objective = "all" is for `stickslip limits`, `sweep` and `spread`; this command bounds one '
                'quantity: take "amplitude", "static force" or "dynamic force"'
            )
        output = choose_bounded_output(table, model.outputs)
        search = LimitSearch(
            system=model.system,
            harmonics=model.harmonics,
            n_sample=model.n_sample,
            objective=make_objective(table, output, model),
            harmonic=find_main_harmonic(model.system),
            base=0.0 if output is None else _make_output_harmonic(output, model).base,
            row=None if output is None else output.row,
            angular_frequency=omega,
            levels=levels,
            nominal=_choose_nominal(table, sweep, model),
            reach=_reach(table),
            settings=LimitSettings(
                population=table.population, sample=table.samples, block=table.block, seed=table.seed
            ),
        )
        try:
            problem = search.problem()
        except BalanceError as error:
            raise _make_case_error(error) from error
    # With the values inserted, the search does not depend on defaults that this process has computed.
    return replace(search, nominal=problem.box.nominal, reach=float(problem.box.reach.max()))


def list_limit_points(case: CaseModel, table: LimitsTable, sweep: Sweep) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """List angular frequencies [rad/s] and levels [-], both ascending.

    Raises
    ------
    CaseError
        There are no frequencies or levels, or too many.
    """
    with located(case, "limits"):
        return tuple(2 * pi * item for item in _choose_frequencies(table, sweep)), _choose_levels(table, sweep)


def _make_case_error(error: BalanceError) -> BalanceError:
    """Make the error for the case's table from an error of the numerical package."""
    return BalanceError(f"the response limits cannot be computed: {error}")


def choose_bounded_output(table: LimitsTable, outputs: Sequence[Sensor]) -> Sensor | None:
    """Choose the sensor whose amplitude a table of one objective bounds; None for forces; see `choose_output`."""
    return None if table.objective in FORCES else choose_output(table, outputs)


def choose_output(table: LimitsTable, outputs: Sequence[Sensor]) -> Sensor:
    """Choose the sensor that [limits] names, or the first one.

    Raises
    ------
    BalanceError
        There is no sensor of this name.
    """
    if table.sensor is None:
        return outputs[0]
    for item in outputs:
        if item.name == table.sensor:
            return item
    names = ", ".join(f'"{item.name}"' for item in outputs)
    raise BalanceError(f"the case has no such sensor: give one of {names}")


def make_objective(table: LimitsTable, output: Sensor | None, model: SolveModel) -> Objective:
    """Make the objective of a table: for an output, or without an output for a contact or line.

    Raises
    ------
    BalanceError
        There is no such contact.
    """
    if table.objective == "loss factor":
        return LossFactor()
    if output is not None:
        return _make_output_harmonic(output, model)
    assert table.contact is not None
    return ContactForceHarmonic(
        joints=find_contacts(table.contact, model),
        direction=DIRECTION[table.direction or "tangential"],
        harmonic=0 if table.objective == "static force" else find_main_harmonic(model.system),
    )


def find_contacts(name: str, model: SolveModel) -> tuple[str, ...]:
    """Find the contacts of the line of this name, or the contact of this name.

    Raises
    ------
    BalanceError
        There is neither.
    """
    known = {joint.name: (joint.name,) for joint in model.system.joints} | {
        line: tuple(item) for line, item in model.lines.items()
    }
    if name not in known:
        names = ", ".join(f'"{name}"' for name in model.lines or known)
        raise BalanceError(f"the case has no such contact: give one of {names}")
    return known[name]


def _make_output_harmonic(output: Sensor, model: SolveModel) -> OutputHarmonic:
    """Make the objective of a sensor's amplitude, with the motion of the base unless the sensor is relative to it."""
    harmonic, carried = find_main_harmonic(model.system), model.base_acceleration(output)
    base = 0.0 if carried is None or harmonic >= len(carried) else complex(carried[harmonic])
    return OutputHarmonic(row=output.row, harmonic=harmonic, base=base)


def _choose_frequencies(table: LimitsTable, sweep: Sweep) -> Sequence[float]:
    if table.frequencies is not None:
        return table.frequencies
    first, last, step = table.first, table.last, table.step
    if isinstance(sweep, FrequencySweepTable | ControlledSweepTable):
        first, last, step = first or sweep.first, last or sweep.last, step or sweep.step
    elif isinstance(sweep, LevelSweepTable) and first is None and last is None:
        return sorted(sweep.frequencies)
    if first is None or last is None:
        missing = "from" if first is None else "to"
        why = "there is no [sweep] to take it from" if sweep is None else "[sweep] varies the level"
        raise BalanceError(f"{missing} is missing, and {why}: give from and to, or frequencies")
    low, high = sorted((first, last))
    if low == high:
        raise BalanceError(f'from and to are both {low:g} Hz: give two ends, or frequencies = ["{low:g} Hz"]')
    step = step or (high - low) / INTERVALS
    count = int(np.ceil((high - low) / step * (1 - 1e-12))) + 1
    if count > MOST_POINTS:
        raise BalanceError(f"step = {step:g} Hz makes {count} points of each level: take at most {MOST_POINTS}")
    return [float(item) for item in np.linspace(low, high, count)]


def _choose_levels(table: LimitsTable, sweep: Sweep) -> tuple[float, ...]:
    if table.levels is not None:
        return table.levels
    if isinstance(sweep, FrequencySweepTable):
        return tuple(sorted(sweep.levels))
    if sweep is None:
        return (1.0,)
    why = "holds an amplitude" if isinstance(sweep, ControlledSweepTable) else "varies the level"
    raise BalanceError(f"levels are missing, and [sweep] {why}: give a list, such as levels = [1, 3, 5]")


def _choose_nominal(table: LimitsTable, sweep: Sweep, model: SolveModel) -> Real | None:
    """Choose the nominal slider positions: at rest under dead weights or the static load, zero, or given ones [m].

    None is for rest under the static load.
    """
    if table.nominal == "rest":
        return None if isinstance(sweep, LevelSweepTable) else model.slider
    names = [
        joint.name if joint.n_slider == 1 else f"{joint.name}, slider {number + 1}"
        for joint in model.system.joints
        for number in range(joint.n_slider)
    ]
    if table.nominal == "stuck":
        return np.zeros(len(names))
    if len(table.nominal) != len(names):
        raise BalanceError(
            f"nominal has {len(table.nominal)} values for {len(names)} sliders: give one for each of {'; '.join(names)}"
        )
    return np.array(table.nominal)


def _reach(table: LimitsTable) -> float | None:
    if table.reach is None:
        return inf if table.objective == "loss factor" else None
    return inf if isinstance(table.reach, str) else table.reach
