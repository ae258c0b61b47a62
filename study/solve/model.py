"""What `stickslip solve` and `limits` compute of a case: a system, what they show of it, and curves."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi

from casefile.table import located
from correlation.model import Sensor
from reduction.errors import JointError
from reduction.jointed_system import JointedSystem
from study.case.kind import OpenCase
from study.case.setup import ReadCase, require_loads
from study.case.sweep import FrequencySweepTable, LevelSweepTable
from study.solve.request import Curve, Output, Row


@dataclass(frozen=True, kw_only=True, eq=False)
class SolveModel:
    """All that a case asks for.

    Parameters
    ----------
    system
        Structure, joints and loads at level 1.
    outputs
        In the order of the case.
    curves
        In the order of the case.
    harmonics, n_sample
        H, and samples per period [-].
    lines
        Joints of each contact line, by name.
    in_newtons
        Whether a level is the amplitude of the force itself [N].
    """

    system: JointedSystem
    outputs: tuple[Output, ...]
    curves: tuple[Curve, ...]
    harmonics: int
    n_sample: int
    lines: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    in_newtons: bool = False


def require_sweep(opened: OpenCase) -> FrequencySweepTable | LevelSweepTable:
    """The sweep of a case.

    Raises
    ------
    CaseError
        It has none.
    """
    sweep: FrequencySweepTable | LevelSweepTable | None = opened.case.sweep
    if sweep is None:
        raise opened.lacks(
            "sweep",
            "there is no [sweep], which says what to solve: add one, e.g. with "
            'from = "100 Hz", to = "120 Hz", levels = [1, 3]',
        )
    return sweep


def solve_model(read: ReadCase) -> SolveModel:
    """What a case asks for, with what was calibrated and added.

    Raises
    ------
    CaseError
        The case lacks a sweep, a load or a sensor that shows a motion.
    """
    opened, model = require_loads(read).opened, read.model
    sweep = require_sweep(opened)
    outputs = tuple(
        Output(name=each.name, row=each.gain * each.row, quantity=each.quantity)
        for each in model.sensors
        if isinstance(each, Sensor)
    )
    if not outputs:
        raise opened.lacks(
            "sensor", "table [[sensor]] is missing, so that nothing is shown: add one, with a name and a place"
        )
    in_newtons = not opened.case.load and read.structure.harmonic_force is not None
    return SolveModel(
        system=model.system,
        outputs=outputs,
        curves=_curves(read, sweep, "N" if in_newtons else ""),
        harmonics=opened.case.harmonics.highest,
        n_sample=opened.case.harmonics.n_sample,
        lines=model.lines,
        in_newtons=in_newtons,
    )


def _curves(read: ReadCase, sweep: FrequencySweepTable | LevelSweepTable, unit: str) -> tuple[Curve, ...]:
    if isinstance(sweep, LevelSweepTable):
        return tuple(
            Curve(
                parameter="level",
                first=sweep.first,
                last=sweep.last,
                fixed=2 * pi * each,
                step=sweep.step,
                label=f"{each:g} Hz",
            )
            for each in sweep.frequencies
        )
    return tuple(
        Curve(
            parameter="frequency",
            first=2 * pi * sweep.first,
            last=2 * pi * sweep.last,
            fixed=level,
            step=None if sweep.step is None else 2 * pi * sweep.step,
            label=(f"{level:g} {unit}" if unit else f"level {level:g}")
            + (f", history {number}" if sweep.histories > 1 else ""),
            slider=slider,
        )
        for level in sweep.levels
        for number, slider in enumerate(_histories(read, sweep), start=1)
    )


def _histories(read: ReadCase, sweep: FrequencySweepTable) -> list[Row] | list[None]:
    """Where the sliders begin: at rest, and where friction histories left them."""
    if read.structure.histories is not None:
        return read.structure.histories(sweep.histories, sweep.seed)
    if sweep.histories > 1:
        with located(read.opened.case, "sweep"):
            raise JointError(
                f"histories = {sweep.histories} begin from rest under dead weights, which a case of "
                f"{read.opened.kind.summary} does not have: remove histories, or find the band with `stickslip limits`"
            )
    return [None]
