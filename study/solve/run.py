"""``stickslip solve``: response curves of a case; finished curves are stored, interrupted ones are continued."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from casefile.table import located
from correlation.model import Sensor
from figure.contact_states import ContactStates, StatePanel
from figure.hysteresis_loops import HysteresisLoop, HysteresisLoops
from figure.response_curves import CurveMark, DrawnCurve, ResponseCurves
from figure.style import choose_evenly
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.matlab import make_matlab_file
from pipeline.checkpoint import Checkpoint
from pipeline.output import replace_file
from study.case.model_doubt import warn_of_model
from study.case.setup import read_case
from study.kind.registry import Extras, open_case
from study.run_context import RunContext
from study.solve.crossing import find_crossing_branches, name_crossing_branch
from study.solve.curve import response_curve
from study.solve.detached import find_detached_curves, name_detached_curve
from study.solve.error_warning import describe_error_warning
from study.solve.model import SolveModel, make_solve_model, require_sweep
from study.solve.refinement import refine_curve
from study.solve.result import (
    DISPLAY_UNIT,
    DRAWN_STATES,
    CurveSummary,
    SolvedCurve,
    compute_output,
    describe_motion_warning,
    find_highest_point,
    find_main_harmonic,
    format_response_csv,
    list_state_names,
    make_response_dataset,
)
from study.solve.stability import curve_stability

#: Largest numbers of joints and of curves in figures; the netCDF file has all.
MOST_JOINTS, MOST_CURVES = 4, 6
LEVEL_LABEL = "level of the harmonic force [-]"


@dataclass(frozen=True, kw_only=True, eq=False)
class SolveResult:
    """Result of the command.

    Parameters
    ----------
    model, balance
        Model of the case, and its harmonic balance.
    curves
        Curves in the order of the case, each followed by its detached curves and by the branches that cross these.
    peaks
        Summary of each curve.
    files
        Written files.
    """

    model: SolveModel
    balance: HarmonicBalance
    curves: tuple[SolvedCurve, ...]
    peaks: tuple[CurveSummary, ...]
    files: tuple[Path, ...]


def run_solve(path: Path, run: RunContext) -> tuple[SolveResult, Extras | None]:
    """Compute the curves of a case file, write tables and figures, and add the results of the case's kind.

    Raises
    ------
    CaseError
        If the case has mistakes, or lacks a table; the error lists all mistakes.
    ComputationFailed
        No steady state was found at the start of a curve.
    """
    opened = open_case(path)
    require_sweep(opened)  # before the reduction, which takes minutes
    read = read_case(opened, run=run)
    warn_of_model(opened.case, read.model.system, swept=True)
    with located(opened.case, "structure"):
        # Errors that belong to no key of the case, such as a body without support.
        solved = solve_curves(make_solve_model(read), path.stem, opened.title, run)
    extend = opened.kind.solved
    return solved, None if extend is None else extend(read, solved, run)


def solve_curves(model: SolveModel, stem: str, title: str, run: RunContext) -> SolveResult:
    """Compute the curves of a model and write tables and figures.

    Parameters
    ----------
    model
        Model of the case.
    stem, title
        Stem of the files, and title of the figures.
    run
        Output folder, store and progress of the run.

    Raises
    ------
    BalanceError
        Harmonic balance is not possible for the system.
    ComputationFailed
        No steady state was found at the start of a curve.
    """
    assert run.output is not None
    balance = HarmonicBalance(system=model.system, n_harmonic=model.harmonics + 1, n_sample=model.n_sample)
    curves = [item for number in range(len(model.curves)) for item in _solve_curve(model, number, stem, run)]
    files = [run.output / f"{stem}_response.{suffix}" for suffix in ("nc", "mat", "csv")]
    data = make_response_dataset(model, curves, title)
    replace_file(files[0], bytes(data.to_netcdf(engine="h5netcdf")))
    replace_file(files[1], make_matlab_file(data))
    replace_file(files[2], format_response_csv(model, curves))
    drawn = _list_results(model, balance, curves, title)
    files += run.draw({f"{stem}_{name}": result for name, result in drawn.items()})
    peaks = tuple(find_highest_point(item, model.outputs[0], find_main_harmonic(model.system)) for item in curves)
    if warning := describe_error_warning(curves, model):
        run.warn(warning)
    if warning := describe_motion_warning(curves, model.outputs):
        run.warn(warning)
    return SolveResult(model=model, balance=balance, curves=tuple(curves), peaks=peaks, files=tuple(files))


def _solve_curve(model: SolveModel, number: int, stem: str, run: RunContext) -> list[SolvedCurve]:
    """Solve one requested curve, with its detached curves and the branches that cross these."""
    assert run.output is not None
    curve = model.curves[number]
    inputs = (model.system, curve, model.harmonics, model.n_sample)
    checkpoint = Checkpoint(run.output / f".{stem}_curve{number}.part", response_curve.key(*inputs), run.warn)
    place = f"curve {number + 1} of {len(model.curves)}, {curve.label}"
    with run.progress.step(place) as report:
        branch = run.store.run(response_curve, *inputs, checkpoint=checkpoint, report=report)
    checkpoint.remove()
    solved = [SolvedCurve(curve=curve, branch=branch, model=model)]
    if model.isolas:
        with run.progress.step(f"isolas near {place}") as report:
            others = run.store.run(find_detached_curves, model.system, curve, branch, *inputs[2:], report=report)
        solved += [
            SolvedCurve(curve=name_detached_curve(curve, other, count), branch=other, model=model)
            for count, other in enumerate(others, start=1)
        ]
    if model.stability:
        solved = [_with_stability(item, place, run) for item in solved]
    if model.branches:
        crossing = [other for item in solved for other in _solve_crossing(item, place, run)]
        solved += [_with_stability(item, place, run) for item in crossing]
    return solved if model.tolerance is None else [_refine_harmonics(item, place, run) for item in solved]


def _solve_crossing(item: SolvedCurve, place: str, run: RunContext) -> list[SolvedCurve]:
    """Compute the branches that cross a curve at its branch points."""
    model = item.model
    assert item.stability is not None
    with run.progress.step(f"branches of {place.partition(',')[0]}, {item.curve.label}"):
        result = run.store.run(
            find_crossing_branches, model.system, item.branch, item.stability, model.harmonics, model.n_sample
        )
    return [
        SolvedCurve(curve=name_crossing_branch(item.curve, count), branch=other, model=model)
        for count, other in enumerate(result, start=1)
    ]


def _refine_harmonics(item: SolvedCurve, place: str, run: RunContext) -> SolvedCurve:
    model = item.model
    assert model.tolerance is not None
    with run.progress.step(f"harmonics of {place.partition(',')[0]}, {item.curve.label}") as report:
        branch = run.store.run(
            refine_curve, model.system, item.curve, item.branch, model.harmonics, model.n_sample, model.tolerance,
            model.output_rows, report=report,
        )  # fmt: skip
    return replace(item, branch=branch)


def _with_stability(item: SolvedCurve, place: str, run: RunContext) -> SolvedCurve:
    model = item.model
    with run.progress.step(f"stability of {place.partition(',')[0]}, {item.curve.label}") as report:
        stability = run.store.run(
            curve_stability, model.system, item.branch, model.harmonics, model.n_sample, report=report
        )
    return replace(item, stability=stability)


def _list_results(
    model: SolveModel, balance: HarmonicBalance, curves: Sequence[SolvedCurve], title: str
) -> dict[str, object]:
    """List the drawn results, by name."""
    harmonic = find_main_harmonic(model.system)
    over_frequency = curves[0].curve.parameter == "frequency"
    label = "frequency [Hz]" if over_frequency else LEVEL_LABEL
    drawn: dict[str, object] = {}
    control = curves[0].curve.control
    if control is not None:
        drawn["force"] = _force_over_frequency(curves, title)
    for number, output in enumerate(model.outputs, start=1):
        if control is not None and output.name == control.sensor:
            continue  # the controlled amplitude is constant
        unit, scale = DISPLAY_UNIT[output.quantity]
        family = [
            DrawnCurve(
                label=item.curve.label,
                parameter=item.parameter,
                response=scale * item.output(output)[:, harmonic],
                group=item.curve.fixed,
                top=None if item.curve.control is None else item.peak(output, harmonic),
                unstable=None if item.stability is None else ~item.stability.is_stable,
                marks=_make_marks(item, output, scale, harmonic),
            )
            for item in curves
        ]
        which = "" if harmonic == 1 else f" of harmonic {harmonic}"
        drawn[f"response_{number}" if len(model.outputs) > 1 else "response"] = ResponseCurves(
            curves=family,
            title=f"{title}: {f'{model.motion_of(output)} {output.quantity}'.strip()} of {output.name}",
            parameter_label=label,
            amplitude_label=f"amplitude{which} [{unit}]",
        )
    joints = _find_busiest(curves, len(model.system.joints))
    if not joints:
        return drawn
    chosen = _spread(curves)
    panels = [
        [
            StatePanel(
                label=f"{model.system.joints[joint].name}, {item.curve.label}",
                parameter=item.parameter,
                states=tuple(list_state_names(model.system.joints[joint], DRAWN_STATES).values()),
                share=item.branch.contact_share[:, joint, list(list_state_names(model.system.joints[joint]))],
            )
            for item in chosen
        ]
        for joint in joints
    ]
    which_joints = "contact states" if len(joints) == len(model.system.joints) else "states of the most active contacts"
    drawn["states"] = ContactStates(panels=panels, title=f"{title}: {which_joints}", parameter_label=label)
    which_point = "the point of smallest force" if chosen[0].curve.control else "the highest point"
    which_curves = "each curve" if len(chosen) == len(curves) else f"{len(chosen)} of {len(curves)} curves"
    drawn["loops"] = HysteresisLoops(
        joints=[(model.system.joints[joint].name, _loops(model, balance, chosen, joint)) for joint in joints],
        title=f"{title}: contacts at {which_point} of {which_curves}",
    )
    return drawn


def _force_over_frequency(curves: Sequence[SolvedCurve], title: str) -> ResponseCurves:
    """Make the curves of the controlled force, with the phase of the reading relative to the force."""
    model = curves[0].model
    output = next(
        item for item in model.outputs if curves[0].curve.control and item.name == curves[0].curve.control.sensor
    )
    family = [
        DrawnCurve(
            label=item.curve.label,
            parameter=item.parameter,
            response=item.level * np.exp(1j * np.angle(item.output(output)[:, 1])),
            top=item.peak(output, 1),
        )
        for item in curves
    ]
    return ResponseCurves(
        curves=family,
        title=f"{title}: force that controls the {output.quantity} of {output.name}",
        parameter_label="frequency [Hz]",
        amplitude_label="amplitude of the force [N]" if model.in_newtons else LEVEL_LABEL,
    )


def _make_marks(item: SolvedCurve, output: Sensor, scale: float, harmonic: int) -> list[CurveMark]:
    """Make the marks of the bifurcations of a curve."""
    return [
        CurveMark(
            label=point.kind.label,
            parameter=point.state.frequency if item.curve.parameter == "frequency" else item.level_of(point.state),
            response=scale * complex(compute_output(item.model, output, point.state)[harmonic]),
        )
        for point in (item.stability.bifurcations if item.stability else ())
    ]


def _find_busiest(curves: Sequence[SolvedCurve], n_joint: int) -> list[int]:
    """Find the joints that slip or separate the most, in the order of the case."""
    stuck = np.array(
        [np.mean([item.branch.contact_share[:, joint, 0].mean() for item in curves]) for joint in range(n_joint)]
    )
    return sorted(int(joint) for joint in np.argsort(stuck, kind="stable")[:MOST_JOINTS])


def _spread(curves: Sequence[SolvedCurve]) -> list[SolvedCurve]:
    """Choose at most `MOST_CURVES` of the curves, with the first and the last."""
    return [curves[place] for place in choose_evenly(len(curves), MOST_CURVES)]


def _loops(
    model: SolveModel, balance: HarmonicBalance, curves: Sequence[SolvedCurve], joint: int
) -> list[HysteresisLoop]:
    harmonic = find_main_harmonic(model.system)
    result = []
    for item in curves:
        point = item.peak(model.outputs[0], harmonic)
        state = item.branch.state(balance, point)
        motion = contact_motion(item.branch.balance_at(balance, point), state)[joint]
        law = model.system.joints[joint]
        result.append(
            HysteresisLoop(
                label=item.curve.label,
                time=motion.time / (2 * np.pi / state.angular_frequency),
                displacement=motion.displacement[0],
                force=motion.force[0],
                normal=None if law.normal_direction is None else motion.force[law.normal_direction],
                is_stop=not law.can_slip,
            )
        )
    return result
