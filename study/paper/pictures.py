"""Figures 12 and 14 to 23 of the replay, in the paper's order."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from correlation.family.verdict import FamilyVerdict
from figure.family_over_limits import FamiliesOverLimits
from figure.force_limits import ForceLimits, LineForceLimits
from figure.hysteresis_loops import HysteresisLoop, HysteresisLoops
from figure.line_forces import LineForce, LineForces
from figure.parameter_intervals import IntervalPanel, ParameterIntervals
from figure.small_responses import SmallResponsePanel, SmallResponses
from figure.tornado import Tornado
from study.compare.family_pictures import make_family_figures
from study.paper.by_hand import ByHand
from study.paper.model import PaperModel, compute_small_response
from study.paper.nonlinear import NonlinearIteration
from study.paper.replay import STEP_LABEL, Replay
from study.paper.sections import SHOWN
from study.paper.sensitivity import Sensitivity

#: Frequencies of a drawn curve [-].
DRAWN = 300
#: Figures as the paper numbers them, and those of the response limits and of the forces by iteration.
RESPONSE_FIGURE = {1: 17, 2: 19, 3: 21, 4: 23}
FORCE_FIGURE = {1: 18, 2: 20, 3: 22}
NUMBERED = (
    {"linear": 14}
    | {f"response_{iteration}": number for iteration, number in RESPONSE_FIGURE.items()}
    | {f"forces_{iteration}": number for iteration, number in FORCE_FIGURE.items()}
)


def draw_replay(result: Replay) -> dict[str, object]:
    """Figures by name.

    Parameters
    ----------
    result
        Replay.
    """
    drawn: dict[str, object] = dict(_loops(result))
    drawn |= draw_by_hand(result.hand, result.model, NUMBERED)
    drawn["sensitivities"] = _make_tornado(result.sensitivity)
    drawn["ways"] = _compare_ways(result)
    return drawn


def _compare_ways(result: Replay) -> ParameterIntervals:
    """Parameters of both calibrations and the truth; a parameter that a calibration does not change keeps its value."""
    start, last = result.hand.nonlinear.iterations[0].parameters, result.hand.last.parameters
    fitted = {
        "by hand": ({item.name: item for item in result.hand.intervals}, last),
        "automatic": ({item.name: item for item in result.own.values}, start),
    }
    panels = []
    for name, (label, factor) in SHOWN.items():
        ways = {}
        for way, (intervals, others) in fitted.items():
            own = intervals.get(name)
            value = getattr(others, name)
            ends = (value, value, value) if own is None else (own.value, own.lower, own.upper)
            if value is not None:
                ways[way] = (factor * ends[0], factor * ends[1], factor * ends[2])
        true = result.truth[name]
        if ways:
            panels.append(IntervalPanel(label=label, truth=None if true is None else factor * true, ways=ways))
    return ParameterIntervals(panels=panels, title="Calibrated parameters of both procedures, and the truth")


def draw_by_hand(hand: ByHand, model: PaperModel, numbered: Mapping[str, int] | None = None) -> dict[str, object]:
    """Figures of the calibration by hand, by name: linear, response_1, forces_1 and so on.

    Parameters
    ----------
    hand
        Iterations.
    model
        Makes models of the rig.
    numbered
        Figure number by name; a figure without a number is left out. None for unnumbered figures.
    """
    figures: dict[str, Any] = {
        "linear": _make_small_responses(hand, model),
        **{f"response_{item.number}": _response(hand, model, item) for item in hand.nonlinear.iterations},
        **{
            f"forces_{item.number}": _make_force_limits(item, model)
            for item in hand.nonlinear.iterations
            if item.limits.forces
        },
    }
    drawn: dict[str, object] = {}
    for name, figure in figures.items():
        if numbered is None:
            drawn[name] = figure
        elif name in numbered:
            title = f"Figure {numbered[name]}: {figure.title[0].lower()}{figure.title[1:]}"
            drawn[f"figure_{numbered[name]}"] = replace(figure, title=title)
    return drawn


def _loops(result: Replay) -> Iterator[tuple[str, object]]:
    loops = result.reference.loops
    share = [np.arange(len(loop.displacement)) / len(loop.displacement) for loop in loops]
    names = [f"{loop.level:g} N" for loop in loops]
    # A loop runs upwards, as in the paper: the force of the blade on the damper, not its reaction.
    sign = float(np.sign(np.sum((loops[0].displacement - loops[0].displacement.mean()) * loops[0].tangential)))
    yield "figure_12a", HysteresisLoops(
        joints=[
            (
                "right damper and blade",
                [
                    HysteresisLoop(
                        label=name, time=t, displacement=loop.displacement - loop.displacement.mean(),
                        force=sign * loop.tangential, normal=loop.normal,
                    )
                    for name, t, loop in zip(names, share, loops, strict=True)
                ],
            )
        ],
        title="Figure 12a: measured friction loops",
    )  # fmt: skip
    top = loops[-1]
    yield "figure_12b", LineForces(
        forces=[
            LineForce(
                name="right damper and blade", label=names[-1], time=share[-1], tangential=top.tangential,
                normal=top.normal,
            )
        ],
        friction_coefficient={"right damper and blade": result.guess.mu},
        title="Figure 12b: ratio of the contact forces",
    )  # fmt: skip


def _make_small_responses(hand: ByHand, model: PaperModel) -> SmallResponses:
    campaign, name = model.campaign, hand.measured.sensor
    panels: list[SmallResponsePanel] = []
    table = campaign.measurement
    number = next(number for number, item in enumerate(campaign.sensors) if item.name == name)
    unit = campaign.sensors[number].unit
    shown, factor = ("um", 1e6) if unit == "m" else (unit, 1.0)
    sides = [(False, "stuck, measured at the lowest level")]
    for free, title in [(True, "free")] * (hand.linear.free is not None) + sides:
        tests = [number for number, test in enumerate(campaign.tests) if (test.configuration == "free") == free]
        rows = np.isin(table.test, tests) & (table.sensor == number) & (table.harmonic == 1)
        if not rows.any():
            continue
        level = float(table.level[rows].min())
        rows &= table.level == level
        frequency = np.linspace(table.frequency[rows].min(), table.frequency[rows].max(), DRAWN)
        lines = {
            f"iteration {number}": factor
            * compute_small_response(model(item.own.parameters), name, frequency, 1.0, free=free)
            for number, item in enumerate(hand.linear.iterations, start=1)
        }
        panels.append(
            SmallResponsePanel(
                label=f"({'abc'[len(panels)]}) {title}", frequency=table.frequency[rows],
                measured=factor * np.abs(table.value[rows]) / level, line_frequency=frequency, lines=lines,
            )
        )  # fmt: skip
    return SmallResponses(
        panels=panels, title=f"Linear responses of {len(hand.linear.iterations)} iterations",
        amplitude=f"amplitude of {name} [{shown}/N]",
    )  # fmt: skip


def _response(hand: ByHand, model: PaperModel, item: NonlinearIteration) -> FamiliesOverLimits:
    own = {sensor.name: sensor for sensor in model.campaign.sensors if sensor.name == hand.measured.sensor}
    return next(
        iter(make_family_figures(item.limits.response, own, f"Response, iteration {item.number}", "N").values())
    )


def _make_force_limits(item: NonlinearIteration, model: PaperModel) -> LineForceLimits:
    channels: dict[tuple[str, int], list[FamilyVerdict]] = {}
    for verdict in item.limits.forces:
        channels.setdefault((verdict.family.sensor, verdict.family.harmonic), []).append(verdict)
    lines = dict.fromkeys(sensor.line for sensor in model.campaign.sensors if sensor.line is not None)
    panels = [
        _make_panel(channels[f"{line}_{letter}", harmonic], f"{line.replace('_', ' ')}", f"{letter}{harmonic}")
        for line in lines
        for harmonic in (0, 1)
        for letter in "TN"
        if (f"{line}_{letter}", harmonic) in channels
    ]
    return LineForceLimits(
        panels=panels, title=f"Contact forces, iteration {item.number}", sampled_label="measured",
        level_label="amplitude of the force [N]",
    )  # fmt: skip


def _make_panel(verdicts: Sequence[FamilyVerdict], line: str, force: str) -> ForceLimits:
    count = max(len(item.family.value) for item in verdicts)
    measured = np.full((count, len(verdicts)), np.nan)
    for column, item in enumerate(verdicts):
        measured[: len(item.family.value), column] = item.family.value
    return ForceLimits(
        line=line,
        force=force,
        level=np.array([item.family.level for item in verdicts]),
        value=np.array([item.limit[:, 0] for item in verdicts]).T,
        sampled=measured,
    )


def _make_tornado(sensitivity: Sensitivity) -> Tornado:
    changes = {
        "upper limit [%]": sensitivity.upper, "lower limit [%]": sensitivity.lower,
        "its frequency [%]": sensitivity.frequency,
        "static N, left [%]": sensitivity.normal, "static T, left [% of N]": sensitivity.tangential,
    }  # fmt: skip
    return Tornado(
        parameters=[STEP_LABEL[name] for name in sensitivity.names],
        changes={name: 100 * value for name, value in changes.items()},
        title=f"Sensitivities at {sensitivity.level:g} N around iteration 3",
    )  # fmt: skip
