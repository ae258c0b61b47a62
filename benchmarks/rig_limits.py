"""Response limits of the rig in the four configurations of the paper and in two more, and limits of contact forces.

    OMP_NUM_THREADS=1 python -m benchmarks.rig_limits [--size MM] [--configurations 3 4] [--forces 3]
        [--band 222 258 1] [--gap-angle 0.35] [--mu 0.6] [--inclination 15] [--folder FOLDER]

Configurations 1 to 4 are those of the paper's Fig. 16: contact parameters; with dead weights shifted along the damper;
also inclined; also with a gap that opens along one line of the left damper. Number 5 has gaps that vibration closes, 6
is the same without gaps (`--configurations 6 5 --forces --band 247 257.1 0.5`). Limits and figures go to the folder,
tables to the screen.
"""

import argparse
import os
import time
from dataclasses import dataclass, replace
from math import pi, radians
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # before numpy reads them

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from benchmarks.rig_case import PreparedRig, prepared  # noqa: E402
from figure.force_limits import ForceLimits, LineForceLimits  # noqa: E402
from figure.limit_band import Band, LimitBands  # noqa: E402
from figure.limit_levels import LimitsByLevel  # noqa: E402
from figure.registry import pictures  # noqa: E402
from geometry.rig import SIDES  # noqa: E402
from hbsolve.balance import HarmonicBalance  # noqa: E402
from hbsolve.limits.objective import ContactForceHarmonic, OutputHarmonic  # noqa: E402
from hbsolve.limits.response_limits import limit_problem, response_limits  # noqa: E402
from hbsolve.limits.result import ResponseLimits  # noqa: E402
from hbsolve.limits.search import LimitSettings  # noqa: E402
from study.kind.registry import OpenCase, open_case  # noqa: E402
from study.shipped_cases import RIG  # noqa: E402

Real = NDArray[np.float64]
LEVELS = (1.0, 3.0, 5.0, 10.0)
MODES = 60
FORCES = {"T0": (0, 0), "N0": (-1, 0), "T1": (0, 1), "N1": (-1, 1)}


@dataclass(frozen=True, kw_only=True)
class Configuration:
    """One configuration. The paper gives shifts relative to an unknown length; here it is that of the cylinder."""

    kt: float
    kn: float
    mu: float
    shift: tuple[float, float] = (0.0, 0.0)
    """Shift of the left and right dead weight away from the blade [m]."""
    inclination: tuple[float, float] = (0.0, 0.0)
    """Inclination of the left and right dead weight towards +y [rad]."""
    gap_angle: float = 0.0
    """Angle of the gap between the left damper and the blade [rad]."""
    gap_end: float = 0.0
    """Gap at the shoulders between both dampers and the blade [m]."""
    crowning: tuple[float, float] | None = None
    """Crowning of the lines of the blade and of the de-couplers [m]; that of the case by default."""


CONFIGURATIONS = {
    1: Configuration(kt=4.65e6, kn=6.75e6, mu=0.6),
    2: Configuration(kt=4.6e6, kn=8.5e6, mu=0.8, shift=(-2.4e-3, 0.6e-3)),
    3: Configuration(
        kt=4.6e6, kn=8.5e6, mu=0.8, shift=(-2.4e-3, 0.6e-3), inclination=(radians(-3), radians(-5))
    ),
    4: Configuration(
        kt=4.6e6, kn=8.5e6, mu=0.8, shift=(-2.4e-3, 0.6e-3), inclination=(radians(-3), radians(-5)),
        gap_angle=radians(0.35),
    ),
    5: Configuration(
        kt=4.6e6, kn=8.5e6, mu=0.6, inclination=(radians(15), radians(-15)), gap_end=5e-6, crowning=(1.5e-6, 0.0)
    ),
    6: Configuration(kt=4.6e6, kn=8.5e6, mu=0.6, inclination=(radians(15), radians(-15)), crowning=(1.5e-6, 0.0)),
}  # fmt: skip


def configured(opened: OpenCase, of: Configuration, size: float) -> PreparedRig:
    """Prepare the rig of a case in one configuration, with elements of the given size [m]."""
    drawn = opened.case.structure
    own: dict[str, dict[str, float]] = {f"{side}_{body}": {} for side in SIDES for body in ("blade", "decoupler")}
    if of.gap_angle:
        own["left_blade"]["gap_angle"] = of.gap_angle
    for line, values in own.items():
        if of.gap_end and line.endswith("blade"):
            values["gap_end"] = of.gap_end
        if of.crowning is not None:
            values["crowning"] = of.crowning[line.endswith("decoupler")]
    lines = {line: getattr(drawn.contact, line).model_copy(update=values) for line, values in own.items()}
    sides = {
        side: getattr(drawn.dead_weight, side).model_copy(update={"shift": shift, "inclination": inclination})
        for side, shift, inclination in zip(SIDES, of.shift, of.inclination, strict=True)
    }
    return prepared(
        opened,
        mesh={"size": size},
        reduction={"modes": MODES},
        contact={"kt": of.kt, "kn": of.kn, "mu": of.mu, **lines},
        dead_weight=sides,
    )


def amplitude_limits(rig: PreparedRig, frequencies: Real, samples: int) -> ResponseLimits:
    """Limits of the tip over frequency [Hz] and level."""
    balance = HarmonicBalance(system=rig.model.system, n_harmonic=6, n_sample=256)
    problem = limit_problem(
        balance, OutputHarmonic(row=rig.model.outputs[0].row), nominal=rig.preloaded.static_state.slider
    )
    settings = LimitSettings(population=8, sample=samples)
    return response_limits(problem, 2 * pi * frequencies, LEVELS, settings=settings)


def by_level(limits: ResponseLimits) -> LimitsByLevel:
    """Largest values of both limits at each level."""
    at = limits.value.argmax(axis=2)
    value = 1e6 * np.take_along_axis(limits.value, at[..., None], axis=2)[..., 0]
    jump = np.take_along_axis(limits.jump, at[..., None], axis=2)[..., 0]
    return LimitsByLevel(
        level=limits.level,
        value=value,
        frequency=limits.frequency[at],
        doubtful=jump | (at == 0) | (at == len(limits.frequency) - 1),
        title="",
        amplitude_label="displacement [um]",
        level_label="amplitude of the force [N]",
    )


def force_panels(rig: PreparedRig, frequency: float) -> list[ForceLimits]:
    """Limits of static and dynamic forces of all lines at one frequency over level, with random histories."""
    from hbsolve.limits.random_histories import independent_histories

    balance = HarmonicBalance(system=rig.model.system, n_harmonic=6, n_sample=256)
    panels = []
    for line, members in rig.preloaded.joined.lines.items():
        for name, (direction, harmonic) in FORCES.items():
            force = ContactForceHarmonic(joints=members, direction=direction, harmonic=harmonic)
            problem = limit_problem(balance, force, nominal=rig.preloaded.static_state.slider)
            settings = LimitSettings(population=4, sample=0)
            limits = response_limits(problem, [2 * pi * frequency], LEVELS, settings=settings)
            left = independent_histories(problem, limits, 20, seed=5)
            panels.append(
                ForceLimits(
                    line=line, force=name, level=limits.level, value=limits.value[:, :, 0], sampled=left.value[:, 0].T
                )
            )
            ends = ", ".join(f"{low:.2f} to {high:.2f}" for low, high in panels[-1].value.T)
            print(f"| {line} | {name} | {ends} | {left.share_outside(1e-3):.1%} |", flush=True)
    return panels


def main() -> None:
    """Print the tables and write the figures."""
    words = argparse.ArgumentParser()
    words.add_argument("--size", type=float, default=5.0)
    words.add_argument("--configurations", type=int, nargs="*", default=[3, 4])
    words.add_argument("--forces", type=int, nargs="*", default=[3])
    words.add_argument("--band", type=float, nargs=3, default=[236.0, 258.1, 0.75], metavar=("FROM", "TO", "STEP"))
    words.add_argument("--gap-angle", type=float, default=0.35, help="of configuration 4 [deg]")
    words.add_argument("--mu", type=float, default=0.6, help="of configurations 5 and 6")
    words.add_argument("--inclination", type=float, default=15.0, help="of configurations 5 and 6, to the blade [deg]")
    words.add_argument("--samples", type=int, default=20)
    words.add_argument("--folder", type=Path, default=Path("build/rig_limits"))
    asked = words.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    opened = open_case(RIG)
    for number in asked.configurations:
        of = CONFIGURATIONS[number]
        if number == 4:
            of = replace(of, gap_angle=radians(asked.gap_angle))
        if number in (5, 6):
            lean = radians(asked.inclination)
            of = replace(of, mu=asked.mu, inclination=(lean, -lean))
        rig = configured(opened, of, 1e-3 * asked.size)
        began = time.process_time()
        limits = amplitude_limits(rig, np.arange(*asked.band), asked.samples)
        limits.save(asked.folder / f"configuration_{number}.nc")
        told = by_level(limits)
        print(f"\nconfiguration {number}: {time.process_time() - began:.0f} s of processor time")
        print("\n| level | upper [um] | at [Hz] | lower [um] | at [Hz] | jumps | outside before repair |")
        print("|---|---|---|---|---|---|---|")
        for at, level in enumerate(LEVELS):
            print(
                f"| {level:g} N | {told.value[1, at]:.2f} | {told.frequency[1, at]:.2f} | {told.value[0, at]:.2f} "
                f"| {told.frequency[0, at]:.2f} | {limits.jump[:, at].sum()} | {limits.n_outside[:, at].sum()} of "
                f"{limits.n_sampled[at].sum()} |",
                flush=True,
            )
        title = f"Rig, configuration {number}: tip"
        bands = [
            Band(
                label=f"{level:g} N",
                frequency=limits.frequency,
                value=1e6 * limits.value[:, at],
                sampled=1e6 * limits.sampled[:, at],
                jump=limits.jump[:, at],
                repaired=limits.repaired[:, at],
            )
            for at, level in enumerate(LEVELS)
        ]
        drawn: dict[str, object] = {
            "band": LimitBands(bands=bands, title=title, amplitude_label="displacement [um]"),
            "levels": replace(told, title=title),
        }
        if number in asked.forces:
            frequency = float(told.frequency[1, 0])
            print(
                f"\n| at {frequency:g} Hz | force | limits at 1, 3, 5, 10 N [N] | histories outside |\n"
                "|---|---|---|---|"
            )
            title = f"Rig, configuration {number}: contact forces at {frequency:g} Hz"
            drawn["forces"] = LineForceLimits(
                panels=force_panels(rig, frequency), title=title, sampled_label="random histories"
            )
        for name, picture in pictures(drawn).items():
            (asked.folder / f"configuration_{number}_{name}.png").write_bytes(picture)


if __name__ == "__main__":
    main()
