"""Compare repeated virtual tests of the shipped rig, by time integration, with its limits by harmonic balance.

    OMP_NUM_THREADS=1 python -m benchmarks.rig_virtual_tests [--repeats 3] [--frequencies 252.5 255 0.5]
        [--levels 3 5 10] [--folder FOLDER]

Each repeat has a random loading history (`transient.virtual_bench.repeats`): placement of the dampers, over- and
undershoot of the preload, overshoot of levels, sweeps up and down. The campaign is written to the folder for
`stickslip compare`. Points whose sliders stay in the box must lie within the limits; the others are counted.
"""

import argparse
import os
import time
from dataclasses import replace
from math import pi
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # before numpy reads them

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from benchmarks.rig_campaign import LINES, SENSORS  # noqa: E402
from benchmarks.rig_case import prepared  # noqa: E402
from correlation.metric.band import coverage, interval_score, tightness  # noqa: E402
from figure.limit_band import Band, LimitBands, limit_band_figure  # noqa: E402
from figure.style import png  # noqa: E402
from hbsolve.limits.response_limits import response_limits  # noqa: E402
from hbsolve.limits.result import ResponseLimits  # noqa: E402
from hbsolve.limits.search import LimitSettings  # noqa: E402
from study.kind.registry import open_case  # noqa: E402
from study.kind.rig.structure import list_measured_places  # noqa: E402
from study.limits.model import make_limit_search  # noqa: E402
from study.limits.table import LimitsTable  # noqa: E402
from study.shipped_cases import RIG  # noqa: E402
from transient.virtual_bench.campaign import CampaignLayout, CampaignPoints, Sweep, write_campaign  # noqa: E402
from transient.virtual_bench.repeats import repeated_tests  # noqa: E402

Real = NDArray[np.float64]
#: Largest relative difference between harmonic balance (H = 5) and time integration at 12 points (`rig_witness`).
BALANCE_ERROR = 0.007
STEPS = 256
TITLES = "| level | points | inside | in the box | inside of those | drift / box | band / spread | score [um] |"


def measured(tests: list[Sweep], n_frequency: int) -> Real:
    """Amplitudes of the tip in the order of the frequencies: rows are the sweeps up and down of each repeat."""
    result = []
    for test in tests:
        tip = np.abs(test.readings.motion[:, list(SENSORS).index("tip"), 0])
        result += [tip[:n_frequency], tip[: n_frequency - 1 : -1]]
    return np.array(result)


def drifts(tests: list[Sweep], nominal: Real, n_frequency: int) -> Real:
    """Largest distances of the sliders from the middle of the box [m], in the order of `measured`."""
    result = []
    for test in tests:
        far = np.abs(test.readings.slider - nominal).max(axis=1)
        result += [far[:n_frequency], far[: n_frequency - 1 : -1]]
    return np.array(result)


def told(level: float, limits: ResponseLimits, row: int, amplitude: Real, drift: Real) -> bool:
    """Print the coverage at a level; returns whether all points with sliders in the box are within the limits."""
    lower, upper = limits.lower[row] * (1 - BALANCE_ERROR), limits.upper[row] * (1 + BALANCE_ERROR)
    held = drift <= limits.reach.max()
    boxed = np.where(held, amplitude, np.nan)
    excess = np.maximum(boxed / limits.upper[row] - 1, 1 - boxed / limits.lower[row])
    inside = f"{coverage(boxed, lower, upper):.1%}, worst {np.nanmax(excess):+.2%}" if held.any() else "none"
    print(
        f"| {level:g} N | {amplitude.size} | {coverage(amplitude, lower, upper):.1%} | {held.sum()} | {inside} "
        f"| {drift.max() / limits.reach.max():.1f} | {np.nanmedian(tightness(amplitude, lower, upper)):.1f} "
        f"| {1e6 * interval_score(amplitude, lower, upper, 0.05).mean():.2f} |",
        flush=True,
    )
    return not held.any() or coverage(boxed, lower, upper) == 1


def main() -> None:
    """Print the tables; write the campaign and the figures."""
    words = argparse.ArgumentParser()
    words.add_argument("--repeats", type=int, default=3)
    band = [252.5, 255.0, 0.5]
    words.add_argument("--frequencies", type=float, nargs=3, default=band, metavar=("FROM", "TO", "STEP"))
    words.add_argument("--levels", type=float, nargs="*", default=[3.0, 5.0, 10.0])
    words.add_argument("--folder", type=Path, default=Path("build/rig_virtual_tests"))
    asked = words.parse_args()
    first, last, step = asked.frequencies
    frequencies = np.arange(first, last + step / 2, step)
    rig = prepared(open_case(RIG), contact={"tangents": "along"})
    search = make_limit_search(rig.case, LimitsTable(), rig.case.sweep, rig.model)
    problem = search.problem()
    # The bench takes the first word of a contact's name as its line.
    joints = [replace(item, name=item.name.replace(".", " ")) for item in rig.model.system.joints]
    places = list_measured_places(rig.preloaded.reduction)
    began = time.process_time()
    tests = []
    for test in repeated_tests(
        replace(rig.model.system, joints=joints), {name: places[name] for name in SENSORS}, frequencies.tolist(),
        asked.levels, n_repeat=asked.repeats, seed=1, steps_per_period=STEPS,
    ):  # fmt: skip
        tests.append(test)
        print(
            f"repeat {test.repeat}, {test.level:g} N: {time.process_time() - began:.0f} s, "
            f"{test.readings.n_period.sum()} periods, {(~test.readings.periodic).sum()} points not periodic",
            flush=True,
        )
    points = CampaignPoints(
        levels=asked.levels, frequencies=frequencies.tolist(), free_frequencies=(), n_repeat=asked.repeats
    )
    write_campaign(
        asked.folder, tests, points, CampaignLayout(title="Rig", sensors=SENSORS, lines=LINES, direction="y")
    )
    amplitude, drift = (
        np.array([result([test for test in tests if test.level == level]) for level in asked.levels])
        for result in (
            lambda own: measured(own, len(frequencies)),
            lambda own: drifts(own, problem.box.nominal, len(frequencies)),
        )
    )
    sound = True
    for reach, name in ((float(problem.box.reach.max()), "band"), (1.01 * drift.max(), "wide_band")):
        # The second box contains all sliders, so all points must lie within its limits.
        limits = response_limits(
            replace(search, reach=reach).problem(), 2 * pi * frequencies, asked.levels, settings=LimitSettings()
        )
        print(f"\nbox of {1e6 * reach:.2f} um\n\n{TITLES}\n{'|---' * TITLES.count(' | ')}|---|")
        for row, level in enumerate(asked.levels):
            sound &= told(level, limits, row, amplitude[row], drift[row])
        (asked.folder / f"{name}.png").write_bytes(picture(limits, amplitude, reach))
    if not sound:
        raise SystemExit("points whose sliders stay in the box lie outside the limits")


def picture(limits: ResponseLimits, amplitude: Real, reach: float) -> bytes:
    """Figure of the limits with the tests, as PNG."""
    bands = [
        Band(
            label=f"{level:g} N",
            frequency=limits.frequency,
            value=1e6 * limits.value[:, row],
            sampled=1e6 * amplitude[row],
            jump=limits.jump[:, row],
            repaired=limits.repaired[:, row],
        )
        for row, level in enumerate(limits.level)
    ]
    title = f"Rig: repeated virtual tests, box of {1e6 * reach:.1f} um"
    words = {"title": title, "amplitude_label": "tip [um]", "sampled_label": "repeated tests"}
    return png(limit_band_figure(LimitBands(bands=bands, **words)))


if __name__ == "__main__":
    main()
