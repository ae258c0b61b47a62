"""``stickslip compare``: compare a model with a campaign; where it fails, in numbers, tables and figures."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import StringIO
from math import isfinite
from pathlib import Path

import numpy as np

from correlation.campaign.measurement import Campaign, name_configuration
from correlation.feature.observation import Observation, find_sweep_directions, split_held_out, take_training_part
from correlation.metric.jump_error import JumpError, compute_jump_errors
from correlation.metric.misfit import Misfit, compute_misfit, summarise_misfit
from correlation.metric.peak_error import ModePeaks, PeakSource, compute_peak_errors
from correlation.metric.response import amplitude_error, phase_error
from correlation.model import Model
from correlation.noise.nuisance import Budget
from correlation.prediction import Prediction
from diagnosis.fit.comparison import NOT_FOUND, Comparison
from diagnosis.fit.weighting import (
    Measured,
    join_measured,
    leave_out_model_error,
    make_comparisons,
    take_prediction,
)
from fe.blas_threads import on_one_blas_thread
from pipeline import fingerprint
from pipeline.store import stage
from study.case.setup import Setup, read_case, require_loads
from study.compare.curve import Drawing
from study.compare.data import compare_data, format_data_csv, select_training_data
from study.compare.data_run import DataComparisonResult, name_step, run_data_comparison
from study.compare.data_view import show_data
from study.compare.page import make_page
from study.compare.pictures import draw_pictures
from study.compare.result import DIFFERS, SWEEP_WORDS, Calibrated, ComparisonResult, list_calibrated
from study.compare.suspicions import find_all_suspicions, require_noise, require_parameters
from study.compare.unknown_gain import SetGains, set_gains
from study.compare.untested_friction import find_untested_friction
from study.kind.registry import open_case
from study.measured_campaign import read_measured
from study.merge_sentences import merge_suspicions
from study.run_context import RunContext

#: Levels are in the unit of the column `level_unit`; the name `level_N` predates shaken bases.
COLUMNS = (
    "set", "configuration", "level_N", "level_unit", "frequency_Hz", "sweep", "sensor", "harmonic", "unit",
    "measured_real", "measured_imag", "deviation", "predicted_real", "predicted_imag", "amplitude_error",
    "phase_error_deg", "standardised_real", "standardised_imag", "whitened_real", "whitened_imag",
)  # fmt: skip


def run_compare(
    case: Path,
    folder: Path,
    run: RunContext,
    *,
    calibrate: bool = False,
    limits: bool = False,
    onto_families: bool = False,
) -> ComparisonResult | DataComparisonResult:
    """Compare, and write tables and figures.

    Parameters
    ----------
    case
        A case file.
    folder
        A campaign.
    run
        Output folder, store and progress of the run.
    calibrate
        Whether the calibration parameters are fitted to the training data first.
    limits
        Whether measured families are compared with the limits of all friction histories.
    onto_families
        Whether the calibration parameters are then fitted to the families as well, starting from the fit to the
        training data; implies `calibrate` and `limits`.

    Raises
    ------
    CaseError, CampaignError
        An error in the case or the campaign.
    """
    calibrate, limits = calibrate or onto_families, limits or onto_families
    opened = open_case(case)  # what is wrong with the file itself is reported first
    campaign = read_measured(folder, run)
    if not len(campaign.measurement):
        if limits:
            option = "--calibrate-families" if onto_families else "--limits"
            run.warn(
                f"{option} compares harmonics with limits, but this campaign has no harmonics, only other types of data"
            )
        setup = read_case(opened, campaign, run).setup
        return run_data_comparison(case, setup, campaign, run, fitted=calibrate)
    require_noise(campaign, folder)
    read = require_loads(read_case(opened, campaign, run))
    setup = read.setup
    compared = find_comparison(setup, campaign, run, calibrate=calibrate)
    for suspicion in compared.suspicions:
        run.warn(str(suspicion))
    title, stem = f"{setup.title}, calibrated" if calibrate else setup.title, f"{case.stem}_compare"
    if limits:
        from study.compare.family_calibration import FamilyRequest, compare_with_families
        from study.compare.family_report import make_family_sections

        asked = FamilyRequest(campaign=campaign, table=opened.case.limits, structure=read.structure, title=title)
        # After the calibration parameters come gains that the campaign does not know.
        factors = (
            [item.factor for item in compared.calibrated[: len(setup.calibration_parameters)]]
            if onto_families
            else None
        )
        families = compare_with_families(compared.model, setup, asked, run, stem, factors)
        sections = (*compared.sections, *make_family_sections(families))
        compared = replace(compared, families=families, sections=sections, files=families.files)
    with run.progress.step("figures", expected=4):
        drawing = Drawing.of(compared)
        drawn = draw_pictures(title, drawing)
        data = compare_data(compared.model, campaign.data)
        others, shown = show_data(compared.model, campaign.data, data, title)
    compared = replace(compared, data=data, sections=(*compared.sections, *shown))
    contents = {f"{stem}.html": make_page(compared, drawing).encode()}
    contents[f"{stem}.csv"] = format_misfit_csv(campaign, compared.train, compared.held_out).encode()
    contents |= {f"{stem}_{name}.png": picture for name, picture in (drawn | others).items()}
    if compared.data:
        contents[f"{stem}_data.csv"] = format_data_csv(compared.data).encode()
    return replace(compared, files=(*run.write_files(contents), *compared.files))


def find_comparison(setup: Setup, campaign: Campaign, run: RunContext, *, calibrate: bool = False) -> ComparisonResult:
    """`compare` from the store of a run, or computed."""
    step, seconds = name_step(15, calibrate)
    key = hash_comparison(setup, campaign, calibrate)
    return run.step(step, expected=seconds).run(comparison, key, setup, campaign, calibrate)


def hash_comparison(setup: Setup, campaign: Campaign, calibrate: bool = False) -> str:
    """Hash of all inputs of a comparison, code included."""
    inputs = {"setup": setup, "campaign": campaign.content, "calibrate": calibrate}
    return fingerprint.key("comparison", inputs, __name__)


@stage("comparison", ignore=("setup", "campaign", "calibrate"))
def comparison(key: str, setup: Setup, campaign: Campaign, calibrate: bool) -> ComparisonResult:
    """`compare` as a stage, so that an interrupted command goes on with its figures; the key covers all inputs."""
    del key
    return compare(setup, campaign, calibrate=calibrate)


@on_one_blas_thread
def compare(setup: Setup, campaign: Campaign, *, calibrate: bool = False) -> ComparisonResult:
    """Compare without writing anything.

    Parameters
    ----------
    setup
        Set-up of a case.
    campaign
        Campaign, as it was read.
    calibrate
        Whether the calibration parameters are fitted to the training data first.

    Raises
    ------
    CampaignError
        A sensor that does not fit the model, or a campaign without repeats.
    """
    gained = set_gains(setup.with_sensors(campaign), campaign)
    data_sets, calibrated, model = _list_data_sets(gained, campaign, calibrate)
    train, *rest = (data_set.misfit for data_set in data_sets)
    suspicions = (*find_all_suspicions(campaign, model, data_sets[0].prediction), *gained.remarks)
    if summarise_misfit(train).whitened <= DIFFERS:
        states = data_sets[0].comparison, data_sets[0].prediction
        suspicions = (*suspicions, *find_untested_friction(model, campaign.data, states))
    peaks = find_peaks(data_sets, campaign.drive.unit)
    return ComparisonResult(
        title=setup.title,
        campaign=campaign,
        model=model,
        prediction=data_sets[0].prediction,
        train=train,
        held_out=rest[0] if rest else None,
        peaks=peaks.errors,
        jumps=find_jumps(data_sets),
        unread=peaks.unread,
        suspicions=merge_suspicions(suspicions),
        calibrated=calibrated,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class DataSet:
    """Training or held-out measurements with a prediction."""

    comparison: Comparison
    prediction: Prediction

    @property
    def peak_source(self) -> PeakSource:
        """Source of its resonances."""
        of = self.comparison
        return PeakSource(
            observed=of.observed, predicted=self.prediction.value, features=of.features, whitening=of.whitening,
            sweeps=of.predictor.sweeps,
        )  # fmt: skip

    @property
    def misfit(self) -> Misfit:
        """Misfit at its points."""
        comparison, value = self.comparison, self.prediction.value
        predicted = comparison.features.of_values(value)
        difference = (comparison.measured - predicted) / comparison.whitening.total_deviation
        standardised = np.where(np.isfinite(predicted), difference, NOT_FOUND)
        return compute_misfit(
            comparison.observed, comparison.features, value, standardised, comparison.residual(self.prediction),
            comparison.noise,
        )  # fmt: skip


def predict_data_sets(
    observed: Sequence[Observation], sweeps: tuple[int, ...], model: Model, budget: Budget
) -> list[DataSet]:
    """Sets of measurements with predictions, weighted by noise, friction histories and numerical error.

    Parameters
    ----------
    observed, sweeps
        Sets of measurements, and the directions in which they were swept.
    model
        Model with their sensors.
    budget
        Numerical error of the model.
    """
    sets = [Measured.prepare(item, sweeps) for item in observed]
    predictor = join_measured(sets).predictor.share(model)
    prediction = predictor.predict(model)
    weights = make_comparisons(sets, model, prediction, budget, budget.refined, fitted=False, predictor=predictor)
    return [
        DataSet(comparison=comparison, prediction=take_prediction(prediction, sets, number))
        for number, (comparison, _) in enumerate(weights)
    ]


def _list_data_sets(
    gained: SetGains, campaign: Campaign, calibrate: bool
) -> tuple[list[DataSet], tuple[Calibrated, ...], Model]:
    setup, unknown = gained.setup, gained.gains.parameters
    if calibrate:
        require_parameters((*setup.calibration_parameters, *unknown))
        # The search takes long to import, and a comparison of a model as it is has no use for it.
        from diagnosis.fit.arrangement import arrange
        from diagnosis.fit.feature_comparison import fit_together
        from diagnosis.fit.finer_model import widen_by_finer_models

        # Effects stay as strong as the case says; the calibration parameters begin anew.
        begin = replace(setup, calibrated={})
        arrangement = arrange(
            campaign, begin.complete, (*setup.calibration_parameters, *unknown), begin.complete_budget
        )
        fit = widen_by_finer_models(arrangement.fit, arrangement.finer)
        fit = fit_together(arrangement.train, fit, select_training_data(campaign, fit.model))
        held_out = arrangement.held_out.predict(fit.model, fit.prediction)
        data_sets = [
            DataSet(comparison=leave_out_model_error(arrangement.train), prediction=fit.prediction),
            DataSet(comparison=leave_out_model_error(arrangement.held_out), prediction=held_out),
        ]
        n = len(setup.calibration_parameters)
        calibrated = list_calibrated(setup.calibration_parameters, fit.values, fit.deviation)
        return data_sets, (*calibrated, *gained.report(fit.values[n:], fit.deviation[n:])), fit.model
    model, budget = setup.complete, setup.complete_budget
    sweeps, none_held_out = find_sweep_directions(campaign), not (campaign.held_out.levels or campaign.held_out.repeats)
    sets = [take_training_part(campaign)] if none_held_out else split_held_out(campaign)
    data_sets = predict_data_sets(sets, sweeps, model, budget)
    if not unknown:
        return data_sets, (), model
    model, gains = gained.refine(model, data_sets[0].comparison)
    return predict_data_sets(sets, sweeps, model, budget), gains, model


def find_jumps(data_sets: Sequence[DataSet]) -> tuple[JumpError, ...]:
    """Errors of jumps: of the training levels from the training data, of the others from the held-out data."""
    result: list[JumpError] = []
    for data_set in data_sets:
        known = {(item.free, item.level) for item in result}
        errors = compute_jump_errors(
            data_set.comparison.observed, data_set.prediction, data_set.comparison.predictor.sweeps
        )
        result += [item for item in errors if (item.free, item.level) not in known]
    return tuple(result)


def find_peaks(data_sets: Sequence[DataSet], level_unit: str) -> ModePeaks:
    """Errors of resonances: of the training levels from the training data, of the others from the held-out data."""
    return compute_peak_errors([data_set.peak_source for data_set in data_sets], level_unit)


def format_misfit_csv(campaign: Campaign, train: Misfit, held_out: Misfit | None) -> str:
    """Format the misfit as CSV, one line per point of the training and held-out data; missing values are empty.

    Parameters
    ----------
    campaign
        Campaign, for the units.
    train, held_out
        Misfits.
    """
    units = {sensor.name: sensor.unit for sensor in campaign.sensors}
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(COLUMNS)
    for name, misfit in (("training", train), ("held out", held_out)):
        if misfit is None:
            continue
        points = misfit.points
        with np.errstate(invalid="ignore", divide="ignore"):
            amplitude = amplitude_error(misfit.measured, misfit.predicted)
            phase = np.degrees(phase_error(misfit.measured, misfit.predicted))
        phase[~misfit.phased & (points.harmonic > 0)] = np.nan
        numbers = np.column_stack(
            [
                misfit.measured.real, misfit.measured.imag, misfit.deviation,
                misfit.predicted.real, misfit.predicted.imag, amplitude, phase, misfit.standardised, misfit.whitened,
            ]
        ).tolist()  # fmt: skip
        columns = (points.free, points.level, points.frequency, points.sweep, points.sensor, points.harmonic)
        for row, (free, level, frequency, sweep, sensor, harmonic) in zip(
            numbers, zip(*(column.tolist() for column in columns), strict=True), strict=True
        ):
            writer.writerow(
                [
                    name,
                    name_configuration(free),
                    f"{level:.9g}",
                    campaign.drive.unit,
                    f"{frequency:.9g}",
                    SWEEP_WORDS[sweep],
                    sensor,
                    harmonic,
                    units[sensor],
                    *(f"{number:.7g}" if isfinite(number) else "" for number in row),
                ]
            )
    return stream.getvalue()
