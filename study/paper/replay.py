"""The whole replay: campaign, first guesses, linear and nonlinear iterations, sensitivities, and then the truth."""

import json
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from casefile.table import load_case
from correlation.family.frequencies import choose_frequencies
from pipeline.parallel import process_pool
from pipeline.pool import make_map
from pipeline.progress import SilentProgress
from study.kind.registry import OpenCase, open_case
from study.paper.automatic_diagnosis import AutomaticDiagnosis, diagnosing_automatically
from study.paper.by_hand import POOL_MODULES, ByHand, calibrate_by_hand, calibrate_linear_stage
from study.paper.campaign import Reference, make_reference
from study.paper.case import PaperCase
from study.paper.first_guess import FirstGuess, guess_first
from study.paper.limits import MeasuredFamilies
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters, meshed
from study.paper.plan import make_paper_plan
from study.paper.sensitivity import Sensitivity, compute_sensitivities
from study.paper.truth import FILE
from study.run_context import RunContext
from study.shipped_cases import PAPER, RIG

#: Steps of the sensitivities: 2 % of a contact parameter, so that the resonance stays among the measured frequencies,
#: and the accuracy of an alignment by hand.
SHARES = {"kt": 0.02, "kn": 0.02, "mu": 0.02, "damping": 0.02}
ALIGNMENT = {
    "shift_left": 0.5e-3, "inclination_left": float(np.radians(2.0)), "gap_angle": float(np.radians(0.005)),
}  # fmt: skip
#: These steps in words.
STEP_LABEL = {name: f"{name} by {100 * share:g} %" for name, share in SHARES.items()} | {
    "shift_left": f"left shift by {1e3 * ALIGNMENT['shift_left']:g} mm",
    "inclination_left": f"left inclination by {np.degrees(ALIGNMENT['inclination_left']):g} deg",
    "gap_angle": f"left rotation by {np.degrees(ALIGNMENT['gap_angle']):g} deg",
}
#: Values of a quick run: elements, modes, points and repeats.
QUICK = {"size": 7e-3, "modes": 30}
QUICK_EFFORT = {"frequencies": 10, "population": 2, "samples": 2, "loop_frequencies": 6, "evaluations": 30}
QUICK_REPEATS, QUICK_STRIDE = 2, 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Replay:
    """All results.

    Parameters
    ----------
    case
        Case of the replay.
    reference
        Campaign.
    guess
        Section 4.1.
    hand
        Table 2, figure 16 and the intervals.
    own
        Automatic diagnosis from iteration 1.
    sensitivity
        Around iteration 3.
    truth
        Parameters of the specimen by name, read after everything else.
    model
        Makes models of the rig.
    """

    case: PaperCase
    reference: Reference
    guess: FirstGuess
    hand: ByHand
    own: AutomaticDiagnosis
    sensitivity: Sensitivity
    truth: Mapping[str, float]
    model: PaperModel


def replay(run: RunContext, *, seed: int, like: int, quick: bool) -> Replay:
    """Replay the paper, or find its parts in the store.

    Parameters
    ----------
    run
        Output folder, store and progress.
    seed, like
        Specimen, see `study.paper.truth.draw_truth`.
    quick
        Whether to use a coarse mesh, few points, two repeats and one round of the automatic diagnosis.

    Raises
    ------
    ComputationFailed
        No resonance in the tests, no rest under the dead weights, or a process that was killed.
    """
    assert run.output is not None
    case, opened = load_case(PAPER, PaperCase), open_case(RIG)
    if quick:
        case = quicken(case)
    folder = run.output / "campaign"
    reference = make_reference(case, opened, folder, run, seed=seed, like=like)
    model = _model(case, opened, reference, run)
    guess = guess_first(reference)
    plan = make_paper_plan(case)
    begun = calibrate_linear_stage(plan, model, guess.mu, run)
    automatic = diagnosing_automatically(model, begun.start, reference.campaign, folder, run, repeat=not quick)
    with automatic as wait_for_diagnosis:
        # One pool for all searches and fits: its processes read the compiled code once.
        with process_pool(POOL_MODULES) as executor:
            hand = calibrate_by_hand(plan, model, begun, run, executor)
            sensitivity = _run_sensitivities(model, hand.last.parameters, hand.measured, run, executor)
        own = wait_for_diagnosis()
    truth = json.loads((folder / FILE).read_text(encoding="utf-8"))["parameters"]
    return Replay(
        case=case, reference=reference, guess=guess, hand=hand, own=own, sensitivity=sensitivity, truth=truth,
        model=model,
    )  # fmt: skip


def quicken(case: PaperCase) -> PaperCase:
    """The case with coarse meshes, few points and two repeats."""
    campaign = case.campaign
    fewer = {
        "repeats": min(campaign.repeats, QUICK_REPEATS),
        "shares": campaign.shares[::QUICK_STRIDE],
        "free_shares": campaign.free_shares[::QUICK_STRIDE],
    }
    coarse, effort = case.model.model_copy(update=QUICK), case.effort.model_copy(update=QUICK_EFFORT)
    return case.model_copy(
        update={"model": coarse, "specimen": coarse, "effort": effort, "campaign": campaign.model_copy(update=fewer)}
    )


def _model(case: PaperCase, opened: OpenCase, reference: Reference, run: RunContext) -> PaperModel:
    coarse = replace(opened, case=meshed(opened.case, case.model.size, case.model.modes))
    coarse.kind.structure(coarse, run)  # reduced with progress; hundreds of models that follow find it in the store
    silent = replace(run, progress=SilentProgress(), quiet=True)
    return PaperModel(opened=coarse, campaign=reference.campaign, run=silent, effort=case.effort)


def _run_sensitivities(
    model: PaperModel, parameters: RigParameters, measured: MeasuredFamilies, run: RunContext, executor: Executor
) -> Sensitivity:
    steps = {name: share * getattr(parameters, name) for name, share in SHARES.items()} | ALIGNMENT
    level = sorted(measured.peak)[-2:][0]
    families = [
        *measured.response,
        *(item for item in measured.forces if item.harmonic == 0 and item.sensor.startswith("left")),
    ]
    count = model.effort.frequencies
    frequency = choose_frequencies(measured.response, count, count)
    step = run.step("sensitivities", expected=60)
    return step.run(
        compute_sensitivities, model.inputs, parameters, steps, families, frequency, level, model,
        report=step.report, map_over=make_map(executor),
    )  # fmt: skip
