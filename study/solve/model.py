"""The model for `stickslip solve` and `limits`: system, outputs and requested curves of a case."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import pi

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from casefile.quantity import ACCELERATION, LENGTH, VELOCITY, read_quantity
from casefile.table import at_key, located
from casefile.validation import did_you_mean
from correlation.model import DERIVATIVE, Sensor
from reduction.errors import JointError
from reduction.jointed_system import JointedSystem
from study.case.setup import ReadCase, require_loads
from study.case.sweep_table import ControlledSweepTable, FrequencySweepTable, LevelSweepTable
from study.kind.registry import OpenCase
from study.solve.amplitude_control import AmplitudeControl
from study.solve.curve import RequestedCurve, Row
from study.solve.frequency_range import warn_of_high_frequency

#: Dimension of a controlled amplitude, by the quantity of the sensor.
CONTROLLED_DIMENSION = {"displacement": LENGTH, "velocity": VELOCITY, "acceleration": ACCELERATION}


@dataclass(frozen=True, kw_only=True, eq=False)
class SolveModel:
    """Model of a case with requested outputs and curves.

    Parameters
    ----------
    system
        Structure, joints and loads at level 1.
    outputs
        Sensors of motion in the order of the case, with their gains in their rows.
    curves
        Requests of curves in the order of the case.
    harmonics, n_sample
        H, and samples per period [-].
    tolerance
        Relative error of the outputs above which points are refined by more harmonics [-]; None for no refinement.
    slider
        Slider positions at rest under dead weights, shape (s,) [m]; None for rest under the static load.
    lines
        Joints of each contact line, by name.
    in_newtons
        Whether a level is the amplitude of the force itself [N].
    stability
        Whether the stability of each point is computed.
    branches
        Whether branches that cross the curves at branch points are computed; this requires `stability`.
    isolas
        Whether isolas are searched for; only for curves over frequency.
    base
        Acceleration of a moving base at each degree of freedom at level 1, shape (n, r) [m/s^2]; None for a fixed base.
        The system moves relative to the base.
    level_power
        Power of the factor Omega^level_power on levels [-].
    """

    system: JointedSystem
    outputs: tuple[Sensor, ...]
    curves: tuple[RequestedCurve, ...]
    harmonics: int
    n_sample: int
    tolerance: float | None = None
    slider: Row | None = None
    lines: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    in_newtons: bool = False
    stability: bool = False
    branches: bool = False
    isolas: bool = False
    base: Complex[NDArray[np.complex128], "n r"] | None = None
    level_power: int = 0

    @property
    def output_rows(self) -> Float[NDArray[np.float64], "n r"]:
        """Rows of the outputs, shape (n, r) [-]."""
        return np.array([output.row for output in self.outputs])

    def base_acceleration(self, output: Sensor) -> Complex[NDArray[np.complex128], " n"] | None:
        """Acceleration of the base in each harmonic of an output's reading at level 1; None if it is not included."""
        return None if self.base is None or output.relative else self.base @ output.row

    def motion_of(self, output: Sensor | None) -> str:
        """Word for headings of an output: "absolute" or "relative" on a moving base; otherwise empty."""
        return "" if self.base is None or output is None else "relative" if output.relative else "absolute"


def require_sweep(opened: OpenCase) -> None:
    """Refuse a case without a sweep.

    Raises
    ------
    CaseError
        The case has no sweep.
    """
    if opened.case.sweep is None:
        raise opened.lacks(
            "sweep",
            'there is no [sweep], which defines what to solve: add one, e.g. with from = "100 Hz", to = "120 Hz", '
            "levels = [1, 3]",
        )


def make_solve_model(read: ReadCase) -> SolveModel:
    """Make the model for `stickslip solve`, with calibrated factors and added effects.

    Raises
    ------
    CaseError
        The case lacks a sweep, a load or a sensor of motion.
    """
    require_sweep(read.opened)
    model, sweep = make_vibrating_model(read), read.opened.case.sweep
    assert sweep is not None
    frequencies = sweep.frequencies if isinstance(sweep, LevelSweepTable) else (sweep.first, sweep.last)
    warn_of_high_frequency(model.system, [2 * pi * item for item in frequencies])
    return replace(
        model,
        curves=_make_controlled_curves(read, model, sweep)
        if isinstance(sweep, ControlledSweepTable)
        else _make_curves(read, sweep, "N" if model.in_newtons else ""),
        stability=not isinstance(sweep, ControlledSweepTable) and sweep.stability,
        branches=not isinstance(sweep, ControlledSweepTable) and sweep.branches,
        isolas=isinstance(sweep, FrequencySweepTable) and sweep.isolas,
    )


def make_vibrating_model(read: ReadCase) -> SolveModel:
    """Make the model without curves, which does not require a sweep.

    Raises
    ------
    CaseError
        The case lacks a load or a sensor of motion.
    """
    opened, model = require_loads(read).opened, read.model
    outputs = tuple(
        replace(item, row=item.gain * item.row, gain=1.0) for item in model.sensors if isinstance(item, Sensor)
    )
    if not outputs:
        raise opened.lacks(
            "sensor", "table [[sensor]] is missing, so nothing is shown: add one, with a name and a place"
        )
    in_newtons = not opened.case.load and read.structure.harmonic_force is not None
    return SolveModel(
        system=model.system,
        outputs=outputs,
        curves=(),
        slider=_list_slider_starts(read, 1, 0)[0],
        harmonics=opened.case.harmonics.highest,
        n_sample=opened.case.harmonics.n_sample,
        tolerance=opened.case.harmonics.tolerance,
        lines=model.lines,
        in_newtons=in_newtons,
        base=None if model.base_acceleration is None else np.asarray(model.base_acceleration, dtype=np.complex128),
        level_power=model.level_power,
    )


def _make_controlled_curves(
    read: ReadCase, model: SolveModel, sweep: ControlledSweepTable
) -> tuple[RequestedCurve, ...]:
    case, sensors = read.opened.case, {output.name: output for output in model.outputs}
    with at_key(case, "sweep", "control"):
        if sweep.control not in sensors:
            guess = did_you_mean(sweep.control, list(sensors))
            raise JointError(f"is not a [[sensor]] of motion; there are {', '.join(sensors)}{guess}")
        output = sensors[sweep.control]
    if case.harmonics.tolerance is not None:
        with at_key(case, "harmonics", "tolerance"):
            raise JointError(
                "refines curves at given levels, not at controlled amplitudes: remove it, and raise highest"
            )
    curves = []
    for number, text in enumerate(sweep.amplitudes):
        with at_key(case, "sweep", "amplitudes", number):
            try:
                amplitude = read_quantity(text, CONTROLLED_DIMENSION[output.quantity])
            except ValueError as error:
                raise JointError(f"{output.name} reads {output.quantity}: {error}") from error
            if amplitude <= 0:
                raise JointError("must be positive: it is the amplitude that the force level controls")
        base_acceleration = None if model.base is None or output.relative else model.base[1]
        control = AmplitudeControl(
            sensor=output.name, row=output.row, derivative=DERIVATIVE[output.quantity], amplitude=amplitude,
            base_acceleration=base_acceleration, level_power=model.level_power,
        )  # fmt: skip
        curves.append(
            RequestedCurve(
                parameter="frequency",
                first=2 * pi * sweep.first,
                last=2 * pi * sweep.last,
                fixed=amplitude,
                step=None if sweep.step is None else 2 * pi * sweep.step,
                label=f"{output.name} {text}",
                slider=model.slider,
                level_power=model.level_power,
                control=control,
            )
        )
    return tuple(curves)


def _make_curves(read: ReadCase, sweep: FrequencySweepTable | LevelSweepTable, unit: str) -> tuple[RequestedCurve, ...]:
    if isinstance(sweep, LevelSweepTable):
        return tuple(
            RequestedCurve(
                parameter="level",
                first=sweep.first,
                last=sweep.last,
                fixed=2 * pi * item,
                step=sweep.step,
                label=f"{item:g} Hz",
                level_power=read.model.level_power,
            )
            for item in sweep.frequencies
        )
    return tuple(
        RequestedCurve(
            parameter="frequency",
            first=2 * pi * sweep.first,
            last=2 * pi * sweep.last,
            fixed=level,
            step=None if sweep.step is None else 2 * pi * sweep.step,
            label=(f"{level:g} {unit}" if unit else f"level {level:g}")
            + (f", history {number}" if sweep.histories > 1 else ""),
            slider=slider,
            level_power=read.model.level_power,
        )
        for level in sweep.levels
        for number, slider in enumerate(_list_slider_starts(read, sweep.histories, sweep.seed), start=1)
    )


def _list_slider_starts(read: ReadCase, n: int, seed: int) -> list[Row] | list[None]:
    """List the initial slider positions: at rest, and after random friction histories."""
    if read.structure.histories is not None:
        return read.structure.histories(n, seed)
    if n > 1:
        with located(read.opened.case, "sweep"):
            raise JointError(
                f"histories = {n} begin at rest under dead weights, which a case of {read.opened.kind.summary} does "
                "not have: remove histories, or compute the band with `stickslip limits`"
            )
    return [None]
