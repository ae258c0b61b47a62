"""From a test case to a test model, its accepted parameters and its numerical error; all mistakes are said at once."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from casefile.mistakes import Mistakes
from casefile.table import load_case
from correlation.campaign.measurement import Campaign
from correlation.errors import ModelDefinitionError
from correlation.model import Model
from correlation.noise.nuisance import Budget
from correlation.sensor_placement import with_sensors
from diagnosis.candidate.catalogue import Catalogue, campaign_catalogue
from diagnosis.fit.arrangement import Added
from diagnosis.fit.calibration_parameter import CalibrationParameter, calibration_parameters
from study.case.added import added_effects, apply_all, apply_by_name
from study.case.model import model_of_case
from study.case.tables import TestCase


@dataclass(frozen=True, kw_only=True, eq=False)
class TestSetup:
    """All that a test case says.

    Parameters
    ----------
    title
        Of the case.
    model
        Structure, contacts, loads at a level of 1 N, sensors: as drawn, without what was calibrated or added.
    accepted
        What every fit calibrates, with its priors.
    budget
        Numerical error of the model.
    effects
        Files with effects of one's own.
    without
        Kinds of effects that are left out.
    added
        Effects that were found missing, with their values.
    calibrated
        Factors on the accepted parameters, by name [-].
    """

    __test__ = False  # no test of pytest's

    title: str
    model: Model
    accepted: tuple[CalibrationParameter, ...]
    budget: Budget
    effects: tuple[Path, ...]
    without: tuple[str, ...]
    added: tuple[Added, ...] = ()
    calibrated: Mapping[str, float] = field(default_factory=dict)

    @property
    def complete(self) -> Model:
        """The model with calibrated factors and added effects."""
        return apply_all(self.model, self.accepted, self.calibrated, self.added)

    @property
    def complete_budget(self) -> Budget:
        """Its numerical error, the finer models as complete as it is."""
        finer = [
            apply_by_name(each, self.effects, self.accepted, self.calibrated, self.added)
            for each in self.budget.refined
        ]
        return replace(self.budget, refined=finer)

    def candidates(self, campaign: Campaign, without: Collection[str] = ()) -> Catalogue:
        """Effects of the case, all but some kinds, as strong as the tests of a campaign make them."""
        return campaign_catalogue(campaign, self.model, without=without, extra=self.effects)


def read_test_case(path: Path | str, campaign: Campaign | None = None) -> TestSetup:
    """Read a test case and make its model.

    Parameters
    ----------
    path
        As ``docs/compare.md`` describes it.
    campaign
        Whose sensors the model has as well.

    Raises
    ------
    CaseError
        With every mistake of the case, each with file and line.
    CampaignError
        A sensor of the campaign that does not fit the model.
    """
    path = Path(path)
    case = load_case(path, TestCase)
    own = model_of_case(case, path.parent)
    model = own if campaign is None else with_sensors(own, campaign)
    mistakes = Mistakes(case)
    for number, file in enumerate(case.effects.files):
        with mistakes.at("effects"):
            if not (path.parent / file).is_file():
                raise ModelDefinitionError(
                    f'files[{number}]: there is no file "{path.parent / file}": check its name and folder'
                )
    refined = []
    for file in case.numerical_error.refined:
        with mistakes.at("numerical_error"):
            refined.append(_refined(path.parent / file, path, own))
    known: tuple[CalibrationParameter, ...] = ()
    with mistakes.at("accepted"):
        known = calibration_parameters(model, deviation=case.accepted.deviation, finer=refined)
    mistakes.raise_if_any()
    files = tuple(path.parent / file for file in case.effects.files)
    added = added_effects(case, model, files, mistakes)
    for name in case.calibrated.factors:
        with mistakes.at("calibrated"):
            if name not in {each.name for each in known}:
                raise ModelDefinitionError(f"{name} is calibrated, but is no accepted parameter here: remove it")
    mistakes.raise_if_any()
    error = case.numerical_error
    setup = TestSetup(
        title=case.title or path.stem,
        model=model,
        accepted=known,
        budget=Budget(frequency=error.frequency, compliance=error.compliance, shares=error.shares, refined=refined),
        effects=files,
        without=case.effects.without,
        added=added,
        calibrated=case.calibrated.factors,
    )
    for number in range(len(added)):
        with mistakes.at("added", number):
            apply_all(model, known, setup.calibrated, added[: number + 1])
    mistakes.raise_if_any()
    return setup


def _refined(file: Path, own: Path, model: Model) -> Model:
    if file.resolve() == own.resolve():
        raise ModelDefinitionError(f'refined: "{file}" is this case itself: name one with a finer mesh, or remove it')
    finer = model_of_case(load_case(file, TestCase), file.parent)
    missing = [each.name for each in model.sensors if each.name not in {other.name for other in finer.sensors}]
    if missing:
        raise ModelDefinitionError(f'refined: "{file}" has no sensor "{missing[0]}": give both cases the same sensors')
    for what, names, others in (("line", model.lines, finer.lines), ("place", model.places, finer.places)):
        lacks = [name for name in names if name not in others]
        if lacks:
            raise ModelDefinitionError(
                f'refined: "{file}" has no {what} "{lacks[0]}", where an effect may act: name it there'
            )
    return finer
