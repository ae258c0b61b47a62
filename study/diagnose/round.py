"""One round of diagnosis of a case; each expensive step is stored, so that an interrupted round can continue."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.feature.observation import Observation, find_sweep_directions, take_training_part
from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.decision.verdict import Finding
from diagnosis.diagnose import Diagnosis, diagnose
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.mode_correction import FrequencyCorrection, ModeCorrection, list_mode_corrections
from diagnosis.fit.problem import Refit
from diagnosis.fit.unknown_gain import has_unknown_gains
from diagnosis.fit.weighting import Measured
from diagnosis.step import RunStep
from diagnosis.threshold.detection_threshold import Thresholds
from diagnosis.threshold.simulation import Simulation
from fe.notebook import Tabular
from pipeline import fingerprint
from pipeline.freed_memory import return_freed_memory
from pipeline.progress import Progress, SilentProgress
from pipeline.store import Store, stage
from pipeline.worker_pool import Workers
from study.case.setup import Setup
from study.compare.unknown_gain import set_gains
from study.diagnose.history import Errors
from study.diagnose.missing_law import RecoveredLaw, describe_law, find_missing_law
from study.diagnose.next_test import NextStep, find_next_step
from study.diagnose.progress import phases
from study.diagnose.thresholds import (
    are_simulated,
    find_shipped_thresholds,
    hash_layout,
    layout,
    simulate_layout_thresholds,
)
from study.merge_sentences import merge_suspicions

if TYPE_CHECKING:
    import pandas

T = TypeVar("T")

#: Largest number of effects that ``--auto`` adds.
MOST_ADDED = 5


@dataclass(frozen=True, kw_only=True, eq=False)
class Round(Tabular):
    """A diagnosis with its case and campaign.

    Parameters
    ----------
    setup
        The case, with the sensors of the campaign.
    campaign
        Measurements.
    diagnosis
        Its result.
    uncalibrated
        The case without calibrated values and added effects.
    run_step
        Looks up or computes further steps of this round.
    remarks
        Remarks on unstated gains that the data do not determine, in sentences.
    law
        Recovered law of the residual that no known effect explains, if any.
    next_step
        Advice on the next test, if the verdict leaves several explanations.
    suspicions
        Suspicious measurements, and remarks on the measurements.
    """

    setup: Setup
    campaign: Campaign
    diagnosis: Diagnosis[Arrangement]
    uncalibrated: Refit
    run_step: RunStep
    remarks: Sequence[str] = ()
    law: RecoveredLaw | None = None
    next_step: NextStep = field(default_factory=lambda: NextStep(advice=None))
    suspicions: Sequence[Suspicion] = ()

    @property
    def wrong(self) -> list[Suspicion]:
        """Suspicions about the measurements, without remarks."""
        return [item for item in self.suspicions if not item.remark]

    @property
    def changes(self) -> list[str]:
        """Changes during a test, which no case explains; if nothing is missing, also suspected ones."""
        is_nothing = self.diagnosis.verdict.finding is Finding.NOTHING
        return [item.headline for item in self.suspicions if item.of_time and (is_nothing or not item.remark)]

    @property
    def best(self) -> Refit | None:
        """Fit of the first effect of the verdict, which explains the measurements best; None without any."""
        return next(iter(self.diagnosis.verdict.effects), None)

    def to_pandas(self) -> "pandas.DataFrame":
        """The verdict: see `Verdict.to_pandas`."""
        return self.diagnosis.verdict.to_pandas()


def diagnose_case(
    setup: Setup,
    campaign: Campaign,
    *,
    without: Sequence[str] = (),
    trials: int = 0,
    store: Store | None = None,
    progress: Progress | None = None,
    announce: Callable[[str], None] | None = None,
    workers: Workers = None,
    suspicions: Sequence[Suspicion] | None = None,
) -> Round:
    """Diagnose a case.

    Parameters
    ----------
    setup
        The case.
    campaign
        Measurements.
    without
        Kinds of effects that are left out, besides those of the case.
    trials
        Number of simulated campaigns for the detection thresholds of a layout without shipped ones; 0 for linear theory
        with a margin.
    store
        Store of the steps; by default nothing is stored.
    progress
        Shows the phases.
    announce
        Receives a sentence if campaigns are to be simulated.
    workers
        Processes that simulate campaigns [-]; one for each core by default. Or the address of a dask scheduler.
    suspicions
        Suspicious measurements; by default those found in the campaign.

    Raises
    ------
    CampaignError
        A sensor that does not fit the model, nothing held out, or a single repeat.
    EffectError
        An unknown kind, or a user-defined effect that fails.
    """
    store, progress = store or Store(None), progress or SilentProgress()
    setup, remarks = prepare_setup(setup, campaign, store)
    without = tuple(sorted({*setup.without, *without}))
    run_step = Steps(store, setup, campaign, without)
    thresholds = find_shipped_thresholds(setup, campaign, without)
    if thresholds is None and trials:
        thresholds = simulate_thresholds(setup, campaign, without, trials, run_step, store, progress, announce, workers)
    with phases(progress, run_step.is_stored, len(setup.added) + 1) as shown:
        diagnosis = diagnose(
            campaign,
            setup.model,
            setup.calibration_parameters,
            setup.budget,
            added=setup.added,
            without=without,
            extra=setup.effect_files,
            thresholds=thresholds,
            run_step=shown.watched(run_step),
            report=shown.report,
        )
        uncalibrated = run_step("nominal", lambda: diagnosis.arrangement.test_uncalibrated(setup.model))
        law = run_step("missing law", lambda: find_missing_law(diagnosis.arrangement, diagnosis.verdict))
        next_step = run_step("next test", lambda: find_next_step(campaign, diagnosis, law))
    return Round(
        setup=setup, campaign=campaign, diagnosis=diagnosis, uncalibrated=uncalibrated, run_step=run_step,
        remarks=remarks, law=describe_law(law), next_step=next_step,
        suspicions=merge_suspicions(campaign.suspicions) if suspicions is None else suspicions,
    )  # fmt: skip


def simulate_thresholds(
    setup: Setup,
    campaign: Campaign,
    without: Sequence[str],
    trials: int,
    run_step: RunStep,
    store: Store,
    progress: Progress,
    announce: Callable[[str], None] | None,
    workers: Workers = None,
) -> Thresholds:
    """Detection thresholds of this layout, from simulated campaigns."""

    def finer(model: Model) -> Catalogue:
        return replace(setup, model=model).candidates(campaign)

    known = setup.candidates(campaign, without)
    key = hash_layout(layout(setup, campaign, known))
    if announce is not None and not are_simulated(key, trials, store):
        announce(
            f"the detection thresholds of this layout of tests are computed once, from {trials} simulated campaigns "
            "without a missing effect; an interrupted run goes on, and without --trials linear theory gives them"
        )
    with progress.step("calibration"):
        arrangement = run_step(
            "arrangement",
            lambda: arrange(
                campaign, setup.model, setup.calibration_parameters, setup.budget, added=setup.added, catalogue_of=finer
            ),
        )
    added = {item.effect.name for item in setup.added}
    effects = [item for item in known.candidates if item.name not in added]
    return simulate_layout_thresholds(
        key,
        Simulation(campaign=campaign, arrangement=arrangement, extra=setup.effect_files),
        effects,
        trials,
        store,
        progress,
        workers,
    )


def prepare_setup(setup: Setup, campaign: Campaign, store: Store) -> tuple[Setup, list[str]]:
    """A case with the sensors and gains of a campaign, and its added effects for the campaign's levels.

    Errors of natural frequencies become calibration parameters if the readings are not linear in them.

    Returns
    -------
    The case, and remarks on unstated gains that the data do not determine.
    """
    setup, remarks = setup.with_sensors(campaign), []
    if has_unknown_gains(campaign):
        gained = set_gains(setup, campaign)
        setup = replace(gained.setup, calibration_parameters=(*setup.calibration_parameters, *gained.gains.parameters))
        remarks = [remark.sentence for remark in gained.remarks]
    observed, sweeps = take_training_part(campaign), find_sweep_directions(campaign)
    corrections = store.run(find_mode_corrections, setup.complete, setup.budget, observed, sweeps)
    numbers = tuple(entry.number for entry in corrections if isinstance(entry, ModeCorrection))
    budget = replace(setup.budget, fitted=numbers)
    setup = replace(setup, calibration_parameters=(*setup.calibration_parameters, *corrections), budget=budget)
    if setup.added:
        known = setup.candidates(campaign, names=[item.effect.name for item in setup.added])
        setup = replace(setup, added=tuple(item.listed_in(known) for item in setup.added))
    return setup, remarks


@stage("mode corrections")
def find_mode_corrections(
    model: Model, budget: Budget, observed: Observation, sweeps: tuple[int, ...]
) -> tuple[FrequencyCorrection, ...]:
    """Errors of natural frequencies that must be parameters; see `list_mode_corrections`."""
    return list_mode_corrections(Measured.prepare(observed, sweeps), model, budget)


def summarise_errors(refit: Refit) -> Errors:
    """Errors of a fitted model."""
    return Errors(
        training=refit.error,
        held_out=refit.held_out_error,
        training_chi2=refit.reduced_chi2_by_noise,
        held_out_chi2=refit.held_out_reduced_chi2_by_noise,
    )


@stage("step of a diagnosis", ignore=("make",))
def step(key: str, name: str, make: Callable[[], Any]) -> Any:
    """One step of a round; the key covers all its inputs, code included."""
    del key, name
    result = make()
    # A step changes and solves models many times, but its result is small.
    return_freed_memory()
    return result


class Steps:
    """Steps of a round, by a fingerprint of all their inputs: from memory, from a store, or computed.

    The fingerprint excludes the detection thresholds, which only judge the results.
    """

    def __init__(self, store: Store, setup: Setup, campaign: Campaign, without: Sequence[str]) -> None:
        self._store, self._key = store, ""
        self._results: dict[str, Any] = {}
        if store.folder is not None:
            inputs = {"setup": replace(setup, title=""), "campaign": campaign.content, "without": without}
            self._key = fingerprint.key("diagnosis", inputs, __name__)

    def __call__(self, name: str, make: Callable[[], T]) -> T:
        """See `diagnosis.step.RunStep`."""
        if name not in self._results:
            self._results[name] = self._store.run(step, self._key, name, make)
        value: T = self._results[name]
        return value

    def is_stored(self, name: str) -> bool:
        """Whether a step is in the store and intact."""
        return self._store.has(step, self._key, name, dict)
