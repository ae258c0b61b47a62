"""Comparison of a model with a campaign without steady states: loops, ring-downs, frequency responses and modes."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_type.registry import Datum
from correlation.errors import CampaignError
from correlation.model import Model
from correlation.sensor_placement import with_sensors
from geometry.plain_number import format_number
from study.case.setup import Setup
from study.compare.data import (
    CLEAR_DEVIATION,
    DataComparison,
    compare_data,
    describe_data,
    document_data,
    format_data_csv,
    without_comparison,
)
from study.compare.data_view import show_data
from study.compare.page import render_sections
from study.compare.report import join_titles
from study.compare.result import DIFFERS, Calibrated, list_calibrated
from study.compare.sentence import Summary, judge
from study.compare.suspicions import find_all_suspicions, require_parameters
from study.compare.untested_friction import find_untested_friction
from study.merge_sentences import merge_suspicions
from study.run_context import RunContext

NEXT = "stickslip compare --calibrate fits the calibration parameters of the case to these data first."


@dataclass(frozen=True, kw_only=True, eq=False)
class DataComparisonResult:
    """Comparison of a model with data other than steady states.

    Parameters
    ----------
    title, campaign
        Titles of the case and of the campaign.
    data
        Comparison of each datum.
    calibrated
        Calibration parameters, if they were fitted first.
    suspicions
        Suspicious data.
    files
        Written files.
    """

    title: str
    campaign: str
    data: tuple[DataComparison, ...]
    calibrated: tuple[Calibrated, ...]
    suspicions: tuple[Suspicion, ...]
    files: tuple[Path, ...] = ()

    @property
    def summary(self) -> Summary:
        """Verdict in a few sentences."""
        return summarise_data(self.data, self.suspicions)

    def text(self) -> str:
        """For people."""
        summary = self.summary
        count = "1 set" if len(self.data) == 1 else f"{len(self.data)} sets"
        lines = [f"{join_titles(self.title, self.campaign)}: {count} of data", ""]
        if self.calibrated:
            values = ", ".join(
                f"{item.name} x {item.factor:.4f} +- {item.half_interval:.2g}" for item in self.calibrated
            )
            lines += [f"Calibrated on the training data: {values}", ""]
        lines += [f"{summary.tag}.", *summary.sentences, "", *describe_data(self.data), "", summary.next, ""]
        return "\n".join([*lines, *map(str, self.files)])

    def document(self) -> dict[str, Any]:
        """The same for ``--json``."""
        return {
            "title": self.title,
            "campaign": self.campaign,
            "summary": [self.summary.tag, *self.summary.sentences],
            "suspicions": [str(item) for item in self.suspicions],
            "calibrated": {item.name: {"factor": item.factor, "deviation": item.deviation} for item in self.calibrated},
            "data": document_data(self.data),
            "files": [str(file) for file in self.files],
        }


def run_data_comparison(
    case: Path, setup: Setup, campaign: Campaign, run: RunContext, *, fitted: bool
) -> DataComparisonResult:
    """Compare, and write tables, figures and a page.

    Parameters
    ----------
    case
        Case file, which names the results.
    setup
        Its model and calibration parameters.
    campaign
        Campaign without steady states.
    run
        Output folder and progress of the run.
    fitted
        Whether the calibration parameters are fitted to the training data first.

    Raises
    ------
    CampaignError
        Nothing to compare, or nothing to calibrate.
    """
    if not campaign.data:
        raise CampaignError(
            f"{campaign.folder}: contains only time records, which no command compares: diagnose them in Python, as "
            "docs/time_records.md shows, or add steady states, loops, ring-downs, frequency responses or modes"
        )
    model = with_sensors(setup.complete, campaign)
    calibrated: tuple[Calibrated, ...] = ()
    name, seconds = name_step(5, fitted)
    with run.progress.step(name, expected=seconds):
        if fitted:
            model, calibrated = calibrate_on_data(setup, campaign)
        data = compare_data(model, campaign.data)
    suspicions = find_all_suspicions(campaign, model)
    if compute_rms(data) <= DIFFERS:
        suspicions = (*suspicions, *find_untested_friction(model, campaign.data))
    suspicions = merge_suspicions(suspicions)
    title = f"{setup.title}, calibrated" if fitted else setup.title
    with run.progress.step("figures", expected=4):
        drawn, sections = show_data(model, campaign.data, data, title)
    result = DataComparisonResult(
        title=setup.title, campaign=campaign.title, data=data, calibrated=calibrated, suspicions=suspicions
    )
    for suspicion in suspicions:
        run.warn(str(suspicion))
    stem = f"{case.stem}_compare"
    html = render_sections(
        title=setup.title,
        campaign=campaign.title,
        summary=result.summary,
        calibrated=calibrated,
        suspicions=suspicions,
        sections=sections,
    )
    contents = {f"{stem}.html": html.encode(), f"{stem}_data.csv": format_data_csv(data).encode()}
    contents |= {f"{stem}_{name}.png": picture for name, picture in drawn.items()}
    return replace(result, files=run.write_files(contents))


def name_step(seconds: float, fitted: bool) -> tuple[str, float | None]:
    """Name of the comparison step, and its first estimate of the duration [s].

    None with a calibration: its number of comparisons depends on the parameters and the errors of the model.
    """
    return ("calibration and comparison", None) if fitted else ("comparison", seconds)


def calibrate_on_data(setup: Setup, campaign: Campaign) -> tuple[Model, tuple[Calibrated, ...]]:
    """The model with its calibration parameters fitted to the training data, and their values.

    Raises
    ------
    CampaignError
        The case accepts no parameter, or all data are held out.
    """
    # Imported late: slow to import, and needed for a calibration only.
    from diagnosis.fit.arrangement import make_unknowns
    from diagnosis.fit.calibration import Ending, calibrate
    from diagnosis.fit.feature_comparison import FeatureComparison

    require_parameters(setup.calibration_parameters)
    training: Sequence[Datum] = [datum for datum in campaign.data if not datum.held_out]
    if not training:
        raise CampaignError(f"{campaign.folder}: all data are held out: leave some to train on")
    base = with_sensors(replace(setup, calibrated={}).complete, campaign)
    unknowns = make_unknowns(base, setup.calibration_parameters, [])
    comparison = FeatureComparison.from_data(training)
    fit = calibrate(comparison, unknowns, unknowns.vanishing, comparison.predict(base), ending=Ending.EXACT)
    # If the misfit exceeds the stated deviations, scale the deviations of the parameters accordingly.
    excess = max(1.0, float(np.sqrt(np.mean(comparison.residual(fit.prediction) ** 2))))
    return fit.model, list_calibrated(setup.calibration_parameters, fit.values, excess * fit.deviation)


def summarise_data(data: Sequence[DataComparison], suspicions: Sequence[Suspicion] = ()) -> Summary:
    """Verdict of a comparison of data other than steady states, given suspicions about them."""
    errors = _join_errors(data)
    lacking = sum(int((~np.isfinite(item.error)).sum()) for item in data)
    if not len(errors):
        tag = "The model cannot be compared with these data"
        reasons = tuple(dict.fromkeys(item.reason for item in data if item.reason))
        return Summary(tone="ambiguous", tag=tag, sentences=reasons, next=NEXT, cards=())
    size = compute_rms(data)
    tone, tag = judge(size, without_comparison(data), suspicions)
    sentences = [
        f"The {len(errors)} measured numbers differ from the model by {size:.3g} standard deviations (root mean "
        f"square); {int((np.abs(errors) > CLEAR_DEVIATION).sum())} of them by more than {CLEAR_DEVIATION:g}."
    ]
    sentences += list(_describe_by_quantity(data))
    if lacking:
        sentences.append(f"For {lacking} numbers the model has no prediction.")
    cards = (("measured numbers", str(len(errors))), ("difference, r.m.s. [standard deviations]", f"{size:.3g}"))
    return Summary(tone=tone, tag=tag, sentences=tuple(sentences), next=NEXT, cards=cards)


def compute_rms(data: Sequence[DataComparison]) -> float:
    """Root mean square of all known errors [standard deviations]; NaN without any."""
    errors = _join_errors(data)
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else np.nan


def _join_errors(data: Sequence[DataComparison]) -> Float[NDArray[np.float64], " n"]:
    return np.concatenate([[], *(item.error[np.isfinite(item.error)] for item in data)])


def _describe_by_quantity(data: Sequence[DataComparison]) -> Iterator[str]:
    """Relative errors of each quantity over all data, if significant."""
    errors: dict[str, list[tuple[float, bool]]] = {}
    for item in data:
        features = item.features
        for row, label in enumerate(features.label):
            # A number that does not differ significantly from zero has no relative error.
            if np.isfinite(item.error[row]) and abs(features.value[row]) > CLEAR_DEVIATION * features.deviation[row]:
                relative = float(item.predicted[row] / features.value[row] - 1)
                quantity = label.split(" at ")[0].split(" of mode ")[0]
                errors.setdefault(quantity, []).append((relative, bool(abs(item.error[row]) > CLEAR_DEVIATION)))
    for quantity, pairs in errors.items():
        clear = [relative for relative, is_clear in pairs if is_clear]
        if clear:
            ends = dict.fromkeys(format_number(100 * end, 3, "+") for end in (min(clear), max(clear)))
            size = f"off by {' to '.join(ends)} %"
            yield f"The {quantity} of the model is {size} in {len(clear)} of {len(pairs)} readings."
