"""Figures 12 and 14 to 23 of the replay, in the paper's order."""

from collections.abc import Iterator, Sequence

import numpy as np

from correlation.family.verdict import FamilyVerdict
from figure.force_limits import ForceLimits, LineForceLimits
from figure.hysteresis_loops import HysteresisLoops
from figure.hysteresis_loops import Loop as DrawnLoop
from figure.line_forces import LineForce, LineForces
from figure.small_responses import SmallResponsePanel, SmallResponses
from figure.tornado import Tornado
from study.compare.family_pictures import family_figures
from study.paper.model import compute_small_response
from study.paper.nonlinear import NonlinearIteration
from study.paper.replay import Replay
from study.paper.sensitivity import Sensitivity

#: Frequencies of a drawn curve [-].
DRAWN = 300
#: Figures of the response limits and of the forces by iteration, as the paper numbers them.
RESPONSE_FIGURE = {1: 17, 2: 19, 3: 21, 4: 23}
FORCE_FIGURE = {1: 18, 2: 20, 3: 22}
SIDES = ("left", "right")


def draw_replay(result: Replay) -> dict[str, object]:
    """Figures by name.

    Parameters
    ----------
    result
        Replay.
    """
    drawn: dict[str, object] = dict(_loops(result))
    drawn["figure_14"] = _small(result)
    for item in result.nonlinear:
        drawn[f"figure_{RESPONSE_FIGURE[item.number]}"] = _response(result, item)
        if item.limits.forces and item.number in FORCE_FIGURE:
            drawn[f"figure_{FORCE_FIGURE[item.number]}"] = _forces(item)
    drawn["sensitivities"] = _tornado(result.sensitivity)
    return drawn


def _loops(result: Replay) -> Iterator[tuple[str, object]]:
    loops = result.reference.loops
    share = [np.arange(len(loop.displacement)) / len(loop.displacement) for loop in loops]
    names = [f"{loop.level:g} N" for loop in loops]
    # A loop runs upwards, as the paper draws it: the force of the blade on the damper, not the other one.
    sign = float(np.sign(np.sum((loops[0].displacement - loops[0].displacement.mean()) * loops[0].tangential)))
    yield "figure_12a", HysteresisLoops(
        joints=[
            (
                "right damper and blade",
                [
                    DrawnLoop(
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


def _small(result: Replay) -> SmallResponses:
    campaign, panels = result.reference.campaign, []
    table = campaign.measurement
    tip = next(number for number, item in enumerate(campaign.sensors) if item.name == "tip")
    for free, title in ((True, "(a) free"), (False, "(b) stuck, measured at the lowest level")):
        tests = [number for number, test in enumerate(campaign.tests) if (test.configuration == "free") == free]
        rows = np.isin(table.test, tests) & (table.sensor == tip) & (table.harmonic == 1)
        level = float(table.level[rows].min())
        rows &= table.level == level
        frequency = np.linspace(table.frequency[rows].min(), table.frequency[rows].max(), DRAWN)
        lines = {
            f"iteration {number}": 1e6
            * compute_small_response(result.model(item.own.parameters), frequency, 1.0, free=free)
            for number, item in enumerate(result.linear.iterations, start=1)
        }
        panels.append(
            SmallResponsePanel(
                label=title, frequency=table.frequency[rows], measured=1e6 * np.abs(table.value[rows]) / level,
                line_frequency=frequency, lines=lines,
            )
        )  # fmt: skip
    return SmallResponses(panels=panels, title="Figure 14: linear responses of three iterations")


def _response(result: Replay, item: NonlinearIteration) -> object:
    sensors = {sensor.name: sensor for sensor in result.reference.campaign.sensors}
    title = f"Figure {RESPONSE_FIGURE[item.number]}: response, iteration {item.number}"
    only_tip = {"tip": sensors["tip"]}
    return next(iter(family_figures(item.limits.response, only_tip, title, "N").values()))


def _forces(item: NonlinearIteration) -> LineForceLimits:
    panels = [
        _panel([v for v in item.limits.forces if (v.family.sensor, v.family.harmonic) == channel], side, force)
        for side in SIDES
        for force, channel in {
            f"{letter}{harmonic}": (f"{side}_decoupler_{letter}", harmonic) for harmonic in (0, 1) for letter in "TN"
        }.items()
    ]
    return LineForceLimits(
        panels=panels, title=f"Figure {FORCE_FIGURE[item.number]}: contact forces, iteration {item.number}",
        sampled_label="measured", level_label="amplitude of the force [N]",
    )  # fmt: skip


def _panel(verdicts: Sequence[FamilyVerdict], side: str, force: str) -> ForceLimits:
    count = max(len(item.family.value) for item in verdicts)
    measured = np.full((count, len(verdicts)), np.nan)
    for column, item in enumerate(verdicts):
        measured[: len(item.family.value), column] = item.family.value
    return ForceLimits(
        line=f"{side} de-coupler",
        force=force,
        level=np.array([item.family.level for item in verdicts]),
        value=np.array([item.limit[:, 0] for item in verdicts]).T,
        sampled=measured,
    )


def _tornado(of: Sensitivity) -> Tornado:
    steps = {
        "kt": "kt, 2 %", "kn": "kn, 2 %", "mu": "mu, 2 %", "damping": "damping, 2 %",
        "shift_left": "left shift, 0.5 mm", "inclination_left": "left inclination, 2 deg",
        "gap_angle": "left rotation, 0.005 deg",
    }  # fmt: skip
    changes = {
        "upper limit [%]": of.upper, "lower limit [%]": of.lower, "its frequency [%]": of.frequency,
        "static N, left [%]": of.normal, "static T, left [% of N]": of.tangential,
    }  # fmt: skip
    return Tornado(
        parameters=[steps[name] for name in of.names], changes={name: 100 * value for name, value in changes.items()},
        title=f"Sensitivities at {of.level:g} N around iteration 3",
    )  # fmt: skip
