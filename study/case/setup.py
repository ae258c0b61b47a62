"""Input of the numerical packages from a case: model, calibration parameters and numerical error."""

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

#: Relative standard deviation of the damping of each mode, in addition to a factor common to all modes, unless a case
#: states it: a rule of thumb, less than the differences between modes of built-up structures [-].
DAMPING_ERROR = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class Setup:
    """A model and its test set-up.

    Parameters
    ----------
    title
        Title of the case.
    model
        Nominal model: structure, joints, loads at level 1 and sensors, without calibration and added effects.
    calibration_parameters
        Calibration parameters, with their priors.
    budget
        Numerical error of the model.
    effect_files
        Python files with the user's effects.
    without
        Kinds of effects that are left out.
    added
        Effects that were added to the case, with their values.
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
        """Model with calibrated factors and added effects."""
        return apply_all(self.model, self.calibration_parameters, self.calibrated, self.added)

    @property
    def complete_budget(self) -> Budget:
        """Numerical error of `complete`, with calibrated factors and added effects on the finer models too."""
        finer = [
            apply_by_name(item, self.effect_files, self.calibration_parameters, self.calibrated, self.added)
            for item in self.budget.refined
        ]
        return replace(self.budget, refined=finer)

    def with_sensors(self, campaign: Campaign) -> "Setup":
        """Return the set-up with all sensors of a campaign, on the finer models too.

        Raises
        ------
        CampaignError
            A sensor does not fit a model.
        """
        refined = [with_sensors(finer, campaign) for finer in self.budget.refined]
        return replace(self, model=with_sensors(self.model, campaign), budget=replace(self.budget, refined=refined))

    def candidates(self, campaign: Campaign, without: Collection[str] = (), names: Sequence[str] = ()) -> Catalogue:
        """List the candidate effects of the case for a campaign.

        Parameters
        ----------
        campaign, without
            See `list_campaign_effects`.
        names
            Names of effects that may act at an unnamed place.
        """
        model = with_places_of(self.model, names)
        return list_campaign_effects(campaign, model, without=without, extra=self.effect_files)


@dataclass(frozen=True, kw_only=True, eq=False)
class ReadCase:
    """A case with its structure and its model.

    Parameters
    ----------
    opened
        Content of the case file.
    structure
        Structure from the case's kind.
    setup
        Model and test set-up for the numerical packages.
    """

    opened: OpenCase
    structure: Structure
    setup: Setup

    @property
    def model(self) -> Model:
        """Model with calibrated factors and added effects."""
        return self.setup.complete


def read_case(path: Path | str | OpenCase, campaign: Campaign | None = None, run: RunContext | None = None) -> ReadCase:
    """Read a case and make its model.

    Parameters
    ----------
    path
        Path of the case file (see ``docs/case.md``), or an open case.
    campaign
        Campaign whose sensors are added to the model.
    run
        Store and progress for the stages of the structure; none by default.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them with file and line.
    CampaignError
        A sensor of the campaign does not fit the model.
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
        The case has no harmonic load, so that nothing vibrates.
    """
    if not read.model.system.dynamic.any():
        raise read.opened.lacks(
            "load", "table [[load]] is missing, so nothing vibrates: add one, with dof = 0 or a place"
        )
    return read


def _make_setup(opened: OpenCase, own: Model, campaign: Campaign | None, run: RunContext) -> Setup:
    """Make the set-up of a model; `own` has only the sensors of the case."""
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
    """Return the error of the damping of each mode; by default zero for a model error of zero (simulated tests)."""
    if error.damping is not None:
        return error.damping
    return DAMPING_ERROR if error.model else 0.0


def _list_parameters(
    model: Model, deviation: Mapping[str, float], refined: list[Model]
) -> tuple[CalibrationParameter, ...]:
    """List the calibration parameters: the common ones, and those of one line, joint or part (names with a dot)."""
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
