"""Repeated virtual tests of a wedge damper, compared with the predicted band of responses.

Each test has its own loading history (preload that overshoots and undershoots, unloading between levels, excitation
that overshoots) and is integrated in time. The result is a campaign folder, as from a laboratory.

python examples/virtual_tests.py [REPEATS]     # 6 by default
"""

import sys
from pathlib import Path

import numpy as np

from correlation.campaign.read_campaign import read_campaign
from correlation.metric.band import coverage, interval_score, tightness
from figure.limit_band import Band, LimitBands, limit_band_figure
from figure.style import png
from hbsolve.balance import HarmonicBalance
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.search import LimitSettings
from study.case.setup import read_case
from study.shipped_cases import LIMITS
from study.solve.model import make_solve_model
from transient.virtual_bench.campaign import CampaignLayout, CampaignPoints, write_campaign
from transient.virtual_bench.repeats import repeated_tests

LEVELS, FREQUENCIES = [0.4, 1.0], np.linspace(265, 292, 7)
REPEATS = int(sys.argv[1]) if len(sys.argv) > 1 else 6
#: Largest distance to which loading and vibration may have dragged a slider [m]: nearly that of these tests.
REACH = 14e-6
#: Relative difference of harmonic balance with five harmonics and integration with 128 steps per period.
BETWEEN_THEM = 0.01


def main() -> None:
    model = make_solve_model(read_case(LIMITS))
    tests = list(
        repeated_tests(
            model.system, {"blade": model.outputs[0].row}, FREQUENCIES.tolist(), LEVELS, n_repeat=REPEATS, seed=1,
            steps_per_period=128,
        )
    )  # fmt: skip
    points = CampaignPoints(levels=LEVELS, frequencies=FREQUENCIES.tolist(), free_frequencies=(), n_repeat=REPEATS)
    layout = CampaignLayout(title="Wedge damper", sensors=["blade"], lines=["blade", "ground"], direction="x")
    write_campaign(Path("campaign"), tests, points, layout)
    table = read_campaign(Path("campaign")).measurement
    balance = HarmonicBalance(system=model.system, n_harmonic=6, n_sample=128)
    problem = limit_problem(balance, OutputHarmonic(row=0), reach=REACH)
    settings = LimitSettings(population=8, sample=40)
    limits = response_limits(problem, 2 * np.pi * FREQUENCIES, LEVELS, settings=settings)
    bands = []
    for at, level in enumerate(LEVELS):
        own = (table.level == level) & (table.harmonic == 1) & (table.sensor == 0)
        measured = np.array([np.abs(table.value[own & (table.frequency == f)]) for f in np.unique(table.frequency)]).T
        held = np.array([
            [problem.box.drift(w) <= REACH for w in test.readings.slider] for test in tests if test.level == level
        ])  # fmt: skip
        # The points of a test are in order of the sweep: frequencies up, then down.
        held = np.stack([held[:, :7], held[:, :6:-1]], axis=1).reshape(measured.shape)
        lower, upper = limits.lower[at] * (1 - BETWEEN_THEM), limits.upper[at] * (1 + BETWEEN_THEM)
        boxed = np.where(held, measured, np.nan)
        print(
            f"level {level:g}: {coverage(measured, lower, upper):.1%} of {measured.size} points inside the band, "
            f"{coverage(boxed, lower, upper):.1%} of the {held.sum()} with all sliders in the box; band over spread "
            f"{np.nanmedian(tightness(measured, lower, upper)):.1f}, interval score "
            f"{1e6 * interval_score(measured, lower, upper, 0.05).mean():.2f} um"
        )
        # All points with sliders in the box are inside the band.
        assert coverage(boxed, lower, upper) == 1.0
        flags = {"jump": limits.jump[:, at], "repaired": limits.repaired[:, at]}
        bands.append(
            Band(label=f"level {level:g}", frequency=limits.frequency, value=1e6 * limits.value[:, at],
                 sampled=1e6 * measured, **flags)
        )  # fmt: skip
    title = "Wedge damper: repeated virtual tests"
    drawn = LimitBands(bands=bands, title=title, amplitude_label="blade [µm]", sampled_label="repeated tests")
    Path("virtual_tests.png").write_bytes(png(limit_band_figure(drawn)))
    print("campaign, virtual_tests.png")


if __name__ == "__main__":
    main()
