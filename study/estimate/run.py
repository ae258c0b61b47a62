"""``stickslip estimate``: first estimates from a campaign, and the changes of the case file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from correlation.campaign.measurement import Campaign, Suspicion
from correlation.data_type.measured_loop import ForceLoop
from correlation.errors import CampaignError
from correlation.model import Model
from correlation.sensor_placement import with_sensors
from diagnosis.fit.calibration_parameter import CalibrationParameter
from geometry.plain_number import format_number
from study.case.setup import read_case
from study.compare.suspicions import find_all_suspicions
from study.diagnose.add import save_step
from study.diagnose.edit import BOUND, UPPER, Written, edit_case, list_changes
from study.diagnose.history import CALIBRATION, HistoryStep, hash_case, history_of, read_text
from study.estimate.contact_force import estimate_from_forces
from study.estimate.first_estimate import FirstEstimate, choose_estimate, list_contradictions
from study.estimate.loops import estimate_from_loop
from study.estimate.resonance import (
    MeasuredResonance,
    estimate_damping,
    estimate_stiffness,
    find_partners,
    find_resonances,
)
from study.kind.registry import open_case
from study.measured_campaign import read_measured
from study.merge_sentences import merge_suspicions
from study.run_context import RunContext

#: Name of this step in a case history.
FIRST_ESTIMATES = "first estimates"

#: Measurement that each parameter needs.
MEASURE = {
    "kt": 'a force-displacement loop of a contact line ([[loop]] with line = "..."), or resonances of the lowest level '
    "with the contacts, preferably together with one without them (a test of the free structure)",
    "mu": "both forces of a contact line with load cells up to the highest level, or a loop in gross slip",
    "zeta": "the resonance of the lowest level, a ring-down, or a mode with its damping ratio",
    "preload": "the normal force of a line with its static part (harmonic 0)",
}
#: Number of standard deviations of a proposed prior within which the measured value lies.
WITHIN_DEVIATIONS = 2.0
#: Calibration parameters that are written into the case, each as one factor.
WRITTEN = ("kt", "mu", "zeta")


@dataclass(frozen=True, kw_only=True)
class EstimationResult:
    """Result of the command.

    Parameters
    ----------
    case
        Case file.
    estimates
        All estimates.
    chosen
        Estimates that are written into the case, as factors.
    missing
        Sentences on parameters that could not be estimated, with the measurements that they need.
    suspicions
        Suspected mistakes in the data of the campaign.
    warnings
        Sentences on contradictions, data that could not be used, and values beyond their priors.
    lines
        Change of the case file, as lines of a diff.
    written
        Whether the case file was changed.
    """

    case: Path
    estimates: tuple[FirstEstimate, ...]
    chosen: tuple[FirstEstimate, ...]
    missing: tuple[str, ...]
    suspicions: tuple[Suspicion, ...]
    warnings: tuple[str, ...]
    lines: tuple[str, ...]
    written: bool

    def document(self) -> dict[str, Any]:
        """Document for ``--json``."""
        return {
            "case": str(self.case),
            "estimates": [
                {**vars(item), "interval": list(item.interval), "bias": list(item.bias), "factor": item.factor,
                 "chosen": item in self.chosen}
                for item in self.estimates
            ],
            "missing": list(self.missing),
            "suspicions": [str(item) for item in self.suspicions],
            "warnings": list(self.warnings),
            "lines": list(self.lines),
            "written": self.written,
        }  # fmt: skip

    def text(self) -> str:
        """Text of the result for the console."""
        lines: list[str] = []
        for item in self.estimates:
            low, high = item.interval
            ends = f"{low:.4g} to {high:.4g}" if np.isfinite(high) else f"at least {low:.4g}"
            ends = f"at most {high:.4g}" if item.is_upper_bound else ends
            unit = "" if item.unit == "-" else f" {item.unit}"
            lines.append(
                f"{item.parameter:8} {item.value:.4g}{unit} ({ends}), {item.factor:.3g} times the model's "
                f"{item.model_value:.4g}; {item.source}"
            )
            # A bias of several estimates is written once, below the first of them.
            lines += [line for sentence in item.bias if (line := f"         {sentence}") not in lines]
        lines += ["", *self.missing] if self.missing else []
        remarks = [*map(str, self.suspicions), *self.warnings]
        lines += ["", *remarks] if remarks else []
        if self.lines:
            head = f"Written into {self.case}:" if self.written else f"--write makes this change of {self.case}:"
            lines += ["", head, *self.lines]
        return "\n".join(lines)


def run_estimate(case: Path, folder: Path, run: RunContext, *, write: bool = False) -> EstimationResult:
    """Estimate the parameters, and change the case file if `write` is set.

    Parameters
    ----------
    case
        Case file.
    folder
        Folder of the campaign.
    run
        Store and progress of the run.
    write
        Whether the case file is changed.

    Raises
    ------
    CaseError, CampaignError
        If the case or the campaign has mistakes.
    """
    opened = open_case(case)
    campaign = read_measured(folder, run)
    setup = read_case(opened, campaign, run).setup
    model, known = setup.model, {item.name: item for item in setup.calibration_parameters}
    with run.progress.step("suspicions", expected=2):
        suspicions = merge_suspicions(find_all_suspicions(campaign, with_sensors(setup.complete, campaign)))
    warnings: list[str] = []
    with run.progress.step("estimates", expected=2):
        estimates = tuple(estimate_all(model, campaign, warnings))
    chosen = tuple(item for name in WRITTEN if name in known and (item := choose_estimate(estimates, name)))
    have = {item.parameter for item in estimates}
    missing = tuple(f"{name} cannot be estimated: measure {what}" for name, what in MEASURE.items() if name not in have)
    before = read_text(case)
    values = {item.parameter: _make_written(item) for item in chosen}
    after = edit_case(before, {}, values, str(case)) if chosen else before
    lines, written = tuple(list_changes(before, after, case.name)), write and after != before
    if written:
        step = HistoryStep(
            what=CALIBRATION, effect=FIRST_ESTIMATES, campaign=str(folder.resolve()), calibrated=values,
            case_before=before, case_after=after, diff=lines, case_key=hash_case(after),
        )  # fmt: skip
        save_step(case, history_of(case), step, after)
    return EstimationResult(
        case=case,
        estimates=estimates,
        chosen=chosen,
        missing=missing,
        suspicions=suspicions,
        warnings=(*warnings, *list_contradictions(estimates), *_describe_beyond_priors(chosen, known)),
        lines=lines,
        written=written,
    )


def estimate_all(model: Model, campaign: Campaign, warnings: list[str]) -> Iterator[FirstEstimate]:
    """Compute all estimates that a campaign allows; sentences on loops that cannot be used are added to the warnings.

    Parameters
    ----------
    model
        Model without calibrated factors.
    campaign
        Campaign; held-out data are not used.
    warnings
        List of sentences, extended in place.
    """
    for datum in campaign.data:
        if isinstance(datum, ForceLoop) and not datum.held_out:
            try:
                yield from estimate_from_loop(model, datum)
            except CampaignError as error:
                warnings.append(str(error))
    yield from estimate_from_forces(model, campaign)
    resonances = list(find_resonances(campaign))
    free = [item for item in resonances if item.free]
    stuck = [item for item in resonances if not item.free]
    without = [estimate for item in free for estimate in estimate_damping(model, item)]
    yield from without
    for item in stuck:
        yield from estimate_damping(model, item)
    if stuck and model.lines:
        best = choose_estimate(without, "zeta")
        factor = best.factor if best else 1.0
        for item in stuck:
            partners: list[MeasuredResonance | None] = [*find_partners(model, item, free)] or [None]
            for partner in partners:
                yield from estimate_stiffness(model, item, partner, factor)


def _describe_beyond_priors(
    chosen: Sequence[FirstEstimate], known: Mapping[str, CalibrationParameter]
) -> Iterator[str]:
    """Sentences on values outside the bounds of their calibration parameter, which a fit would not keep."""
    for item in chosen:
        (factor,) = known[item.parameter].parameters
        bound = min(max(item.factor, factor.lower), factor.upper)
        if bound != item.factor:
            wide = format_number(abs(item.factor - factor.vanishes) / WITHIN_DEVIATIONS, 2)
            yield (
                f"{item.parameter}: {item.factor:.3g} times the value of the case was measured, but its prior limits "
                f"fits to {bound:.3g}: correct it in the case, or write {item.parameter} = {wide} in [accepted]"
            )


def _make_written(item: FirstEstimate) -> Written:
    """Factor on the model's value, with a note of half its interval, or the kind of its bound, and its source."""
    low, high = (end / item.model_value for end in item.interval)
    width = f"{(high - low) / 2:.2g}" if np.isfinite(high) else BOUND
    width = UPPER if item.is_upper_bound else width
    source = item.source.replace("\n", " ")
    return Written(value=float(f"{item.factor:.6g}"), note=f"{width}; first estimate from {source}")
