"""The band of responses over friction history: a wedge damper at four levels, and the static forces of its contacts.

Sticking contacts can carry any tangential force within Coulomb's cone, so that repeated tests differ. The limits are
computed first; then random histories that were not used in the search are compared with them.

python examples/response_limits.py [FREQUENCIES]     # number of frequencies of the curves, 13 by default
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from figure.force_limits import ForceLimits, LineForceLimits, force_limits_figure
from figure.limit_band import Band, LimitBands, limit_band_figure
from figure.style import png
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.loss_factor import loss_factor_limits
from hbsolve.limits.objective import ContactForceHarmonic, OutputHarmonic
from hbsolve.limits.random_histories import independent_histories
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.search import LimitSettings
from study.case.setup import read_case
from study.shipped_cases import LIMITS
from study.solve.model import make_solve_model

LEVELS, RESONANCE = [0.1, 0.4, 1.0, 4.0], 283.0
FREQUENCIES = np.linspace(259, 295, int(sys.argv[1]) if len(sys.argv) > 1 else 13)
SETTINGS = LimitSettings(population=8, sample=60)


def main() -> None:
    system = make_solve_model(read_case(LIMITS)).system
    balance = HarmonicBalance(system=system, n_harmonic=4, n_sample=64)
    problem = limit_problem(balance, OutputHarmonic(row=0))
    limits = response_limits(problem, 2 * np.pi * FREQUENCIES, LEVELS, settings=SETTINGS)
    fresh = independent_histories(problem, limits, 60, seed=1)
    print(f"sliders at most {1e6 * limits.reach.max():.2f} um from rest; upper over lower limit, widest:")
    bands = []
    for at, level in enumerate(LEVELS):
        print(f"  level {level:g}: {(limits.upper[at] / limits.lower[at]).max():.2f}")
        flags = {"jump": limits.jump[:, at], "repaired": limits.repaired[:, at]}
        value, sampled = 1e6 * limits.value[:, at], 1e6 * fresh.value[at].T
        bands.append(Band(label=f"level {level:g}", frequency=FREQUENCIES, value=value, sampled=sampled, **flags))
    drawn = LimitBands(bands=bands, title="Wedge damper", amplitude_label="blade [µm]")
    Path("limits.png").write_bytes(png(limit_band_figure(drawn)))
    # The paper's limits, in the same box: the amplitudes at the largest and the least loss factor.
    paper = loss_factor_limits(
        balance, OutputHarmonic(row=0), 2 * np.pi * FREQUENCIES, LEVELS[1:3], reach=problem.box.reach, settings=SETTINGS
    )
    apart = [replace(bands[at], sampled=1e6 * paper.amplitude[:, at - 1]) for at in (1, 2)]
    title, dots = "Wedge damper: limits of the amplitude, and the paper's", "at the extreme loss factors"
    drawn = LimitBands(bands=apart, title=title, amplitude_label="blade [µm]", sampled_label=dots)
    Path("papers_limits.png").write_bytes(png(limit_band_figure(drawn)))
    panels, escaped = [], fresh.share_outside(1e-3)
    for line in ("blade", "ground"):
        for force, direction in (("T0", 0), ("N0", -1)):
            both = [f"{line} 1", f"{line} 2"]
            problem = limit_problem(balance, ContactForceHarmonic(joints=both, direction=direction))
            held = response_limits(problem, [2 * np.pi * RESONANCE], LEVELS, settings=SETTINGS)
            left = independent_histories(problem, held, 60, seed=2)
            escaped = max(escaped, left.share_outside(1e-3))
            names = {"line": line, "force": force, "level": held.level}
            panels.append(ForceLimits(**names, value=held.value[:, :, 0], sampled=left.value[:, 0].T))
    title = f"Wedge damper: static forces at {RESONANCE:g} Hz"
    forces = LineForceLimits(panels=panels, title=title, sampled_label="random histories")
    Path("static_forces.png").write_bytes(png(force_limits_figure(forces)))
    print(f"histories outside by more than 0.1 %: {100 * escaped:.2f} % at most")
    print("limits.png, papers_limits.png, static_forces.png")
    # The band is wide where contacts slip, and hardly any history is outside.
    assert (limits.upper[1] / limits.lower[1]).max() > 1.1
    assert escaped <= 0.01


if __name__ == "__main__":
    main()
