"""From a case to what the numerical packages take: a model, its calibration parameters and its numerical error."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from casefile.table import Mistakes
from correlation.campaign.measurement import Campaign
from correlation.errors import ModelDefinitionError
from correlation.model import Model
from correlation.noise.nuisance import Budget
from correlation.sensor_placement import with_sensors
from diagnosis.candidate.catalogue import Catalogue, list_campaign_effects
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.calibration_parameter import CalibrationParameter, list_calibration_parameters
from diagnosis.fit.scoped_parameter import make_scoped_parameter
from study.case.added import apply_all, apply_by_name, read_added_effects, with_places_of
from study.case.load_scale import find_scale_warning
from study.case.model import make_case_model
from study.case.structure import Structure
from study.case.tables import NumericalErrorTable
from study.case.trust import require_trust
from study.kind.registry import OpenCase, open_case
from study.run_context import RunContext, silent_run

#: Relative standard deviation of the damping of a mode beside a factor that is common to all, unless a case states it:
#: a rule of thumb, less than modes of built-up structures differ by [-].
DAMPING_ERROR = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class Setup:
    """A model beside its test set-up.

    Parameters
    ----------
    title
        Title of the case.
    model
        Structure, joints, loads at level 1, sensors: as drawn, without what was calibrated or added.
    calibration_parameters
        Calibration parameters, with their priors.
    budget
        Numerical error of the model.
    effect_files
        Files with effects of one's own.
    without
        Kinds of effects that are left out.
    added
        Effects that were found missing, with their values.
    calibrated
        Factors on the calibration parameters, by name [-].
    """

    title: str
    model: Model
    calibration_parameters: tuple[CalibrationParameter, ...]
    budget: Budget
    effect_files: tuple[Path, ...]
    without: tuple[str, ...]
    added: tuple[AddedEffect, ...] = ()
    calibrated: Mapping[str, float] = field(default_factory=dict)

    @property
    def complete(self) -> Model:
        """The model with calibrated factors and added effects."""
        return apply_all(self.model, self.calibration_parameters, self.calibrated, self.added)

    @property
    def complete_budget(self) -> Budget:
        """Its numerical error, the finer models as complete as it is."""
        finer = [
            apply_by_name(item, self.effect_files, self.calibration_parameters, self.calibrated, self.added)
            for item in self.budget.refined
        ]
        return replace(self.budget, refined=finer)

    def with_sensors(self, campaign: Campaign) -> "Setup":
        """The set-up with every sensor of a campaign, on the finer models too.

        Raises
        ------
        CampaignError
            A sensor that does not fit a model.
        """
        refined = [with_sensors(finer, campaign) for finer in self.budget.refined]
        return replace(self, model=with_sensors(self.model, campaign), budget=replace(self.budget, refined=refined))

    def candidates(self, campaign: Campaign, without: Collection[str] = (), names: Sequence[str] = ()) -> Catalogue:
        """Effects of the case, all but some kinds, as strong as the tests of a campaign make them.

        Parameters
        ----------
        campaign, without
            As for `list_campaign_effects`.
        names
            Names of effects, which may act where no place is.
        """
        model = with_places_of(self.model, names)
        return list_campaign_effects(campaign, model, without=without, extra=self.effect_files)


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadCase:
    """A case, the structure that its kind made, and the model on it.

    Parameters
    ----------
    opened
        The case as its file says it.
    structure
        Structure that the kind made.
    setup
        Model and test set-up for the numerical packages.
    """

    opened: OpenCase
    structure: Structure
    setup: Setup

    @property
    def model(self) -> Model:
        """The model with calibrated factors and added effects."""
        return self.setup.complete


def read_case(path: Path | str | OpenCase, campaign: Campaign | None = None, run: RunContext | None = None) -> ReadCase:
    """Read a case and make its model.

    Parameters
    ----------
    path
        Path of the case file, as ``docs/case.md`` describes it; or the case itself.
    campaign
        Campaign whose sensors the model has as well.
    run
        Store and progress of the stages of the structure; none by default.

    Raises
    ------
    CaseError
        With every mistake of the case, each with file and line.
    CampaignError
        A sensor of the campaign that does not fit the model.
    """
    opened = path if isinstance(path, OpenCase) else open_case(path)
    run = run or silent_run()
    structure = opened.kind.structure(opened, run)
    own = make_case_model(opened.case, structure)
    if campaign is not None and (warning := find_scale_warning(opened.case.load, campaign.drive)):
        run.warn(f"{opened.path}: {warning}")
    return ReadCase(opened=opened, structure=structure, setup=_make_setup(opened, own, campaign, run))


def require_loads(read: ReadCase) -> ReadCase:
    """Require that a case has loads, and return it.

    Raises
    ------
    CaseError
        It has no harmonic load, so that it says nothing of any measurement.
    """
    if not read.model.system.dynamic.any():
        raise read.opened.lacks(
            "load", "table [[load]] is missing, so nothing vibrates: add one, with dof = 0 or a place"
        )
    return read


def _make_setup(opened: OpenCase, own: Model, campaign: Campaign | None, run: RunContext) -> Setup:
    """The set-up of a model; `own` has the sensors of the case alone."""
    case, folder = opened.case, opened.folder
    model = own if campaign is None else with_sensors(own, campaign)
    mistakes = Mistakes(case)
    for number, file in enumerate(case.effects.files):
        with mistakes.at("effects"):
            if not (folder / file).is_file():
                raise ModelDefinitionError(
                    f'files[{number}]: there is no file "{folder / file}": check its name and folder'
                )
            require_trust([folder / file], opened.path)
    refined = []
    for file in case.numerical_error.refined:
        with mistakes.at("numerical_error"):
            finer = _read_refined(folder / file, opened.path, own, run)
            refined.append(finer if campaign is None else with_sensors(finer, campaign))
    known: tuple[CalibrationParameter, ...] = ()
    with mistakes.at("accepted"):
        known = _list_parameters(model, case.accepted.given, refined)
    mistakes.raise_if_any()
    files = tuple(folder / file for file in case.effects.files)
    added = read_added_effects(case, model, files, mistakes)
    for name in case.calibrated.given:
        with mistakes.at("calibrated"):
            if name not in {item.name for item in known}:
                raise ModelDefinitionError(
                    f"{name} is in [calibrated], but is not a calibration parameter of this case: remove it"
                )
    mistakes.raise_if_any()
    error = case.numerical_error
    setup = Setup(
        title=opened.title,
        model=model,
        calibration_parameters=known,
        budget=Budget(
            frequency=error.frequency,
            damping=_choose_damping_error(error),
            compliance=error.compliance,
            shares=error.shares,
            refined=refined,
            model=error.model,
        ),
        effect_files=files,
        without=case.effects.without,
        added=added,
        calibrated=case.calibrated.given,
    )
    for number in range(len(added)):
        with mistakes.at("added", number):
            apply_all(model, known, setup.calibrated, added[: number + 1])
    mistakes.raise_if_any()
    return setup


def _choose_damping_error(error: NumericalErrorTable) -> float:
    """Error of the damping of each mode; measurements that another model made have none unless the case says so."""
    if error.damping is not None:
        return error.damping
    return DAMPING_ERROR if error.model else 0.0


def _list_parameters(
    model: Model, deviation: Mapping[str, float], refined: list[Model]
) -> tuple[CalibrationParameter, ...]:
    """Calibration parameters: the common ones, and those of one line, joint or part, whose names have a dot."""
    common = {name: value for name, value in deviation.items() if "." not in name}
    scoped = [make_scoped_parameter(model, name, value) for name, value in deviation.items() if "." in name and value]
    return (*list_calibration_parameters(model, deviation=common, finer=refined), *scoped)


def _read_refined(file: Path, own: Path, model: Model, run: RunContext) -> Model:
    if file.resolve() == own.resolve():
        raise ModelDefinitionError(f'refined: "{file}" is this case: name one with a finer mesh, or remove it')
    if not file.is_file():
        raise ModelDefinitionError(f'refined: there is no file "{file}": check its name and folder')
    opened = open_case(file)
    finer = make_case_model(opened.case, opened.kind.structure(opened, run))
    missing = [item.name for item in model.sensors if item.name not in {other.name for other in finer.sensors}]
    if missing:
        raise ModelDefinitionError(f'refined: "{file}" has no sensor "{missing[0]}": give both cases the same sensors')
    for what, names, others in (("line", model.lines, finer.lines), ("place", model.places, finer.places)):
        lacks = [name for name in names if name not in others]
        if lacks:
            raise ModelDefinitionError(
                f'refined: "{file}" has no {what} "{lacks[0]}", where an effect may act: add it there'
            )
    return finer
