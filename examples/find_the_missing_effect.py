"""From misfit to missing effect to smaller error: a beam on the virtual test bench with an effect that its model lacks.

python examples/find_the_missing_effect.py [FOLDER]     # takes minutes; writes figures and pages to FOLDER
"""

import sys
from pathlib import Path

import numpy as np

from correlation.campaign.read_campaign import read_campaign
from pipeline.progress import LineProgress
from study.beam.case import write_beam_case
from study.case.setup import read_case
from study.compare import report as compare_report
from study.compare.curve import Drawing
from study.compare.pictures import draw_pictures
from study.compare.run import ComparisonResult, compare
from study.diagnose import report as diagnose_report
from study.diagnose.add import add
from study.diagnose.history import history_of
from study.diagnose.page import make_files
from study.diagnose.round import Round, diagnose_case
from study.diagnose.run import record_diagnosis
from study.diagnose.stages import make_waterfall
from transient.virtual_bench.hidden_effect import make_campaign, random_effect

folder, progress, seed = Path(sys.argv[1] if len(sys.argv) > 1 else "found"), LineProgress(sys.stdout), 3
measured = folder / "campaign"
hidden = random_effect(np.random.default_rng(seed))  # random kind and place; ten times the strength, to be clear
with progress.step("simulating the measurements", expected=10):
    make_campaign(measured, seed=seed, kind=hidden.kind, place=hidden.place, strength=10 * hidden.strength)
campaign, case = read_campaign(measured), write_beam_case(folder)  # the case: the beam as drawn


def show(compared: ComparisonResult, name: str) -> None:
    """Show where the model fails, as text and as responses."""
    print(f"\n=== {name}\n{compare_report.format_report(compared)}")
    drawn = draw_pictures(f"Beam, {name}", Drawing.of(compared))
    (folder / f"{name.replace(' ', '_')}_frf.png").write_bytes(drawn["frf_jointed"])


def diagnose(name: str) -> Round:
    """Report the missing effect as text, page and figures, and record it in the history of the case."""
    result = diagnose_case(read_case(case, campaign).setup, campaign, progress=progress)
    record_diagnosis(result, case, measured)
    for file, content in make_files(result, history_of(case), case).items():
        (folder / f"{name}_{file}").write_bytes(content)
    print(f"\n=== {name}\n{diagnose_report.format_report(result)}\n")
    return result


show(compare(read_case(case).setup, campaign, calibrate=True), "calibrated")  # no calibration explains the misfit
best = diagnose("first").diagnosis.verdict.effects[0]
assert best.effect is not None
print(diagnose_report.describe_step(add(case, best.effect.name), case))
show(compare(read_case(case).setup, campaign), f"with {best.effect.name}")
last = diagnose("second")
for step in make_waterfall(last, history_of(case)):
    print(f"{step.name:14} error {100 * step.training:6.2f} %; held-out reduced chi-squared {step.held_out_chi2:6.2f}")
print(f"Hidden effect: {hidden.kind} at {hidden.place}, {10 * hidden.strength:.4g} (fitted: {best.strength:.4g})")
assert (best.effect.name, last.best) == (f"{hidden.kind} at {hidden.place}", None)
