"""Families over the limits of a model, and calibration onto them, for ``stickslip compare``."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign
from correlation.family.family import measured_families
from correlation.family.frequencies import choose_frequencies
from correlation.family.noise import estimate_repeat_errors
from correlation.family.verdict import FamilyVerdict
from correlation.model import Model
from diagnosis.fit.family_fit import FamilyFit, fit_families
from diagnosis.fit.family_target import FamilyGroup, FamilyTarget, list_numerical_errors
from pipeline.store import stage
from study.case.added import apply_all
from study.case.setup import Setup
from study.case.structure import Structure
from study.compare.families import FamilyCalibration, FamilyComparison, compare_families, select_families
from study.compare.suspicions import require_parameters
from study.limits.table import LimitsTable
from study.run_context import RunContext

#: Frequencies of the bands in the loop of the fit.
LOOP_FREQUENCIES = 10


@dataclass(frozen=True, kw_only=True, eq=False)
class FamilyRequest:
    """Measurements to compare with limits.

    Parameters
    ----------
    campaign
        Campaign as it was read.
    table
        Table [limits] of the case.
    structure
        Structure of the case.
    title
        Title of the case.
    """

    campaign: Campaign
    table: LimitsTable
    structure: Structure
    title: str


def compare_with_families(
    model: Model,
    setup: Setup,
    request: FamilyRequest,
    run: RunContext,
    stem: str,
    factors: Sequence[float] | None = None,
) -> FamilyComparison:
    """Families over the limits of a model, or of a model calibrated onto them.

    Parameters
    ----------
    model
        Model with the sensors of the campaign, calibrated to the mean or not.
    setup
        Set-up of the case, for its calibration parameters and numerical error.
    request
        Campaign and case.
    run
        Output folder, store and progress.
    stem
        Stem of the file names.
    factors
        Factors of the fit to the mean; with them the parameters are fitted to the families.

    Raises
    ------
    CampaignError
        The case accepts no parameter.
    ComputationFailed
        As `compare_families`.
    """

    def compared(candidate: Model, title: str, name: str) -> FamilyComparison:
        return compare_families(
            candidate,
            setup.complete_budget,
            request.campaign,
            request.table,
            request.structure,
            run,
            title=title,
            stem=name,
        )

    if factors is None:
        return compared(model, request.title, stem)
    require_parameters(setup.calibration_parameters, "none can be fitted to families")
    before = compared(model, request.title, f"{stem}_mean")
    if not before.verdicts:
        return before
    fit = _fit(setup, request, np.array(factors), before.verdicts, run)
    fitted = compared(_compose_model(setup, fit.values), f"{request.title} onto families", stem)
    calibration = FamilyCalibration(
        names=tuple(item.name for item in setup.calibration_parameters),
        to_mean=np.array(factors), to_families=fit.values,
        verdicts_of_mean=before.verdicts, n_evaluation=fit.n_evaluation,
    )  # fmt: skip
    return replace(fitted, calibration=calibration, files=(*fitted.files, *before.files))


def _fit(
    setup: Setup, request: FamilyRequest, start: Float[NDArray[np.float64], " p"],
    before: Sequence[FamilyVerdict], run: RunContext,
) -> FamilyFit:  # fmt: skip
    families = measured_families(request.campaign)
    chosen, _ = select_families(setup.model, request.campaign, families)
    held = request.campaign.held_out
    trained = [
        replace(item, curves=curves)
        for item in chosen
        if not np.isclose(item.level, held.levels, rtol=1e-9).any()
        and (curves := tuple(curve for curve in item.curves if curve.repeat not in held.repeats))
    ]
    sensors = {item.name: item for item in request.campaign.sensors}
    moving = [item for item in trained if sensors[item.sensor].line is None]
    errors = estimate_repeat_errors(request.campaign, families)
    histories = request.structure.histories
    target = FamilyTarget(
        groups=[FamilyGroup(trained, choose_frequencies(moving or trained, LOOP_FREQUENCIES, LOOP_FREQUENCIES))],
        errors=errors,
        shift=float(np.hypot(errors.frequency, setup.budget.frequency)),
        nominal=None if histories is None else histories(1, 0)[0],
        numerical=list_numerical_errors(trained, before),
    )
    step = run.step("calibration onto families", expected=120)
    return step.run(family_calibration, setup, target, start, report=step.report)


@stage("calibration onto families", ignore=("report",))
def family_calibration(
    setup: Setup,
    target: FamilyTarget,
    start: Float[NDArray[np.float64], " p"],
    report: Callable[[float, float], None] | None = None,
) -> FamilyFit:
    """Stage with the fit.

    Parameters
    ----------
    setup
        Model and calibration parameters.
    target
        Families.
    start
        Factors to start from, shape (p,) [-].
    report
        Progress.
    """
    return fit_families(
        lambda values: _compose_model(setup, values), setup.calibration_parameters, start, target, report=report
    )


def _compose_model(setup: Setup, values: Float[NDArray[np.float64], " p"]) -> Model:
    """The model with factors on its calibration parameters, and the added effects."""
    factors = {item.name: float(value) for item, value in zip(setup.calibration_parameters, values, strict=True)}
    return apply_all(setup.model, setup.calibration_parameters, factors, setup.added)
