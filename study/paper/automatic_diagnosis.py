"""Automatic diagnosis next to the calibration by hand: `diagnose --auto` from iteration 1, without further input."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from pathlib import Path
from typing import Any

from correlation.campaign.measurement import Campaign
from correlation.errors import CampaignError
from correlation.uncertainty.interval import TWO_SIDED_95
from diagnosis.decision.verdict import Finding
from geometry.rig import SIDES
from pipeline.output import replace_file
from pipeline.parallel import process_pool
from pipeline.pool import start_call
from pipeline.progress import SilentProgress
from pipeline.store import stage
from study.diagnose.history import name_history_file
from study.diagnose.report import format_headline
from study.diagnose.round import Round, summarise_errors
from study.diagnose.run import diagnose_file
from study.diagnose.table import format_interval, list_factors, list_strengths
from study.paper.case_file import write_parameters
from study.paper.interval import Interval
from study.paper.model import PaperModel
from study.paper.parameters import RigParameters
from study.run_context import RunContext

#: Calibration parameters of a diagnosis by the name of what they scale.
SCALED = {"kt": "kt", "kn": "kn", "mu": "mu", "damping": "zeta"}
#: Parameters of the rig by the effect that changes them.
CHANGED = {f"{kind} of {side} dead weight": f"{kind}_{side}" for side in SIDES for kind in ("shift", "inclination")}
#: Source of an interval of a diagnosis.
COVARIANCE = "covariance of least squares"
#: Folder of the case file in the output folder.
CASE_FOLDER = "automatic"
#: Modules that a diagnosis needs.
POOL_MODULES = ("study.diagnose.run",)
#: Duration of three rounds beside the calibration by hand [s].
EXPECTED = 1800.0
#: Findings whose best effect is part of the answer.
NAMED = (Finding.MISSING, Finding.AMBIGUOUS)


@dataclass(frozen=True, kw_only=True)
class AutomaticRound:
    """A round of the diagnosis: its verdict, and the held-out errors before and with the best effect [-]."""

    sentence: str
    held_before: float
    held_after: float


@dataclass(frozen=True, kw_only=True, eq=False)
class AutomaticDiagnosis:
    """Result of the automatic diagnosis.

    Parameters
    ----------
    files
        Case file of iteration 1 with the effects that were added, and its history: contents by name.
    rounds
        In their order.
    values
        Parameters of the rig with their intervals.
    others
        Effects without a parameter in the calibration by hand, with their strengths in words.
    is_complete
        Whether the last round found nothing missing.
    """

    files: Mapping[str, str]
    rounds: tuple[AutomaticRound, ...]
    values: tuple[Interval, ...]
    others: tuple[str, ...]
    is_complete: bool


@contextmanager
def diagnosing_automatically(
    model: PaperModel, start: RigParameters, campaign: Campaign, folder: Path, run: RunContext, *, repeat: bool = True
) -> Iterator[Callable[[], AutomaticDiagnosis]]:
    """Diagnose in a process of its own, while the caller calibrates by hand, which leaves a core free at times.

    Parameters as for `diagnose_automatically`. At an early end the process ends too; its finished steps are stored.

    Yields
    ------
    Waits for the result, with progress; raises `ComputationFailed` if the process was killed.
    """
    assert run.output is not None
    make = partial(diagnose_automatically, model, start, campaign, folder, repeat=repeat)
    inputs = (write_case(model, start), start, campaign.content, campaign, folder, run.output / CASE_FOLDER, run)
    if run.store.has(diagnose_text, *inputs, repeat=repeat):
        yield lambda: make(run)
        return
    silent = replace(run, progress=SilentProgress(), quiet=True)
    with process_pool(POOL_MODULES, workers=1) as executor:
        wait = start_call(executor, make, silent)

        def wait_with_progress() -> AutomaticDiagnosis:
            with run.progress.step("automatic diagnosis", expected=EXPECTED):
                return wait()

        yield wait_with_progress


def diagnose_automatically(
    model: PaperModel, start: RigParameters, campaign: Campaign, folder: Path, run: RunContext, *, repeat: bool = True
) -> AutomaticDiagnosis:
    """Diagnose iteration 1, add the missing effect, and repeat until none is missing without doubt.

    Parameters
    ----------
    model
        Makes models of the rig.
    start
        Parameters of iteration 1.
    campaign, folder
        Campaign as it was read, and its folder.
    run
        Output folder, store and progress.
    repeat
        Whether there is more than one round.

    Returns
    -------
    The result; for a campaign that cannot be diagnosed, a single round with the reason.
    """
    assert run.output is not None
    text, into = write_case(model, start), run.output / CASE_FOLDER
    into.mkdir(exist_ok=True)
    outcome = run.store.outcome(
        diagnose_text, text, start, campaign.content, campaign, folder, into, run, repeat=repeat
    )
    if outcome.cached:
        run.progress.stored("automatic diagnosis")
        for name, content in outcome.value.files.items():
            replace_file(into / name, content)
    return outcome.value


@stage("automatic diagnosis", ignore=("campaign", "folder", "into", "run"))
def diagnose_text(
    text: str,
    start: RigParameters,
    content: Mapping[str, Any],
    campaign: Campaign,
    folder: Path,
    into: Path,
    run: RunContext,
    *,
    repeat: bool,
) -> AutomaticDiagnosis:
    """`diagnose_automatically` for the text of a case, as a stage: the hundreds of stored steps take long to read.

    Parameters
    ----------
    text, start
        Text of the case of iteration 1, and its parameters.
    content
        Content of the campaign: the result depends on it.
    campaign, folder
        Campaign as it was read, and its folder.
    into
        Folder of the case file.
    run
        Store and progress.
    repeat
        Whether there is more than one round.
    """
    del content
    file = into / "iteration_1.toml"
    history = name_history_file(file)
    # The steps of the rounds are in the store: the case is edited anew from where it began.
    history.unlink(missing_ok=True)
    replace_file(file, text)
    try:
        rounds = diagnose_file(file, campaign, folder, run, auto=repeat).rounds
    except CampaignError as error:
        # A campaign too small for a diagnosis can still be calibrated by hand.
        refused = AutomaticRound(sentence=f"no diagnosis: {error}", held_before=nan, held_after=nan)
        return AutomaticDiagnosis(files={file.name: text}, rounds=(refused,), values=(), others=(), is_complete=False)
    values, others = read_values(rounds[-1], start)
    return AutomaticDiagnosis(
        files={item.name: item.read_text(encoding="utf-8") for item in (file, history)},
        rounds=tuple(map(_summarise_round, rounds)), values=values, others=others,
        is_complete=rounds[-1].diagnosis.verdict.finding is Finding.NOTHING,
    )  # fmt: skip


def write_case(model: PaperModel, parameters: RigParameters) -> str:
    """Text of the case file with some parameters, on the mesh of the model."""
    table = model.opened.case.structure
    mesh: dict[tuple[str, ...], Any] = {
        ("mesh", "size"): f"{1e3 * table.mesh.size:g} mm",
        ("reduction", "modes"): table.reduction.modes,
    }
    text = model.opened.path.read_text(encoding="utf-8")
    return write_parameters(text, parameters, model.find_ratio(parameters), mesh)


def _summarise_round(result: Round) -> AutomaticRound:
    best = result.best if result.diagnosis.verdict.finding in NAMED else None
    before = summarise_errors(result.diagnosis.baseline)
    return AutomaticRound(
        sentence=format_headline(result), held_before=before.held_out,
        held_after=(before if best is None else summarise_errors(best)).held_out,
    )  # fmt: skip


def read_values(result: Round, start: RigParameters) -> tuple[tuple[Interval, ...], tuple[str, ...]]:
    """Parameters of the rig after the last round, and the effects that correspond to none of them.

    Parameters
    ----------
    result
        The last round.
    start
        Parameters that the calibration parameters multiply.
    """
    best = result.best if result.diagnosis.verdict.finding in NAMED else None
    refit = result.diagnosis.verdict.baseline if best is None else best
    scaled = list_factors(result.setup, refit)
    values = [
        _make_interval(name, getattr(start, name), 0.0, scaled[factor])
        for name, factor in SCALED.items()
        if factor in scaled
    ]
    others: list[str] = []
    for effect, value, deviation in list_strengths(result.setup, refit):
        if effect.name in CHANGED:
            name = CHANGED[effect.name]
            values.append(_make_interval(name, 1.0, getattr(start, name), (value, deviation)))
        else:
            others.append(f"{effect.name}: {format_interval(value, deviation, effect.parameters[0])}")
    return tuple(values), tuple(others)


def _make_interval(name: str, unit: float, offset: float, number: tuple[float, float]) -> Interval:
    value, half = offset + unit * number[0], TWO_SIDED_95 * unit * number[1]
    return Interval(name=name, value=value, lower=value - half, upper=value + half, source=COVARIANCE)


def by_name(values: Sequence[Interval]) -> Mapping[str, Interval]:
    """Intervals by parameter."""
    return {item.name: item for item in values}
