"""Diagnosis of data that are compared through features: one round."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from correlation.data_type.indication import CLEAR_DEVIATION, Indication, name_causes
from correlation.data_type.registry import DATA_TYPES, Datum
from correlation.model import Model
from correlation.noise.error_size import MAX_ERROR_SIZES
from diagnosis.candidate.catalogue import Catalogue, Extra, list_effects
from diagnosis.candidate.scale import measure_scale
from diagnosis.decision.verdict import Finding, Verdict
from diagnosis.diagnose import Diagnosis, ProgressFractions, Report, screen_and_refit
from diagnosis.feature.arrangement import FeatureArrangement, arrange_features
from diagnosis.fit.added import AddedEffect
from diagnosis.fit.calibration_parameter import CalibrationParameter
from diagnosis.fit.problem import Refit
from diagnosis.step import RunStep, compute_step
from diagnosis.time_record.held_out import MAX_EXCESS_LEFT, MIN_STANDARD_ERRORS, HeldOutTest

#: Timed on ring-downs and loops.
PROGRESS = ProgressFractions(screening=0.3, fits=0.5, tests=0.9, covariances=1.0, explanation=1.0, intervals=1.0)
#: Least number of indications that a verdict reports, if there are as many.
MIN_INDICATIONS = 4

FeatureDiagnosis: TypeAlias = Diagnosis[FeatureArrangement]


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureResult:
    """A diagnosis, and direct indications of the data.

    Parameters
    ----------
    diagnosis
        Fits and verdict.
    indications
        Differences between properties of the data and of the calibrated model.
    """

    diagnosis: FeatureDiagnosis
    indications: tuple[Indication, ...]


def diagnose_features(
    base: Model,
    data: Sequence[Datum],
    calibration: Sequence[CalibrationParameter],
    *,
    added: Sequence[AddedEffect] = (),
    without: Collection[str] = (),
    extra: Sequence[Extra] = (),
    run_step: RunStep = compute_step,
    report: Report | None = None,
) -> FeatureResult:
    """Identify the effect that is missing from a model.

    An effect is named if the held-out error in excess of the standard deviations falls significantly and little of it
    remains (`diagnosis.time_record.held_out`). Indications that the model does not reproduce are reported in any case.

    Parameters
    ----------
    base
        Model without the added effects, with the sensors of the data.
    data
        Data, some of them held out.
    calibration
        Calibration parameters, which every fit sets.
    added
        Effects added in earlier rounds; all are fitted again.
    without, extra
        As for `diagnosis.candidate.catalogue.list_effects`.
    run_step
        Looks up the stored result of a step, or computes it.
    report
        Called with the name of a step and the completed share of the round [-].

    Raises
    ------
    CampaignError
        The model lacks something that the data refer to, or all data are held out.
    EffectError
        An unknown kind of effect, or an invalid effect of the user's own.
    """
    report = report or (lambda _step, _share: None)
    report("calibration", 0.0)
    level, there = find_level(base, data), {item.effect.name for item in added}
    arrangement = calibrate_features(base, data, calibration, level, added=added, extra=extra, run_step=run_step)
    catalogue = list_effects(base, without=without, extra=extra, level=level)
    catalogue = replace(catalogue, candidates=tuple(item for item in catalogue.candidates if item.name not in there))
    scores, baseline, refits = screen_and_refit(arrangement, catalogue.candidates, run_step, report, PROGRESS)
    refits.sort(key=lambda refit: refit.held_out_error)
    indications = run_step("indications", lambda: list_indications(arrangement.fit.model, data))
    verdict = _judge(arrangement, baseline, refits, data, indications, catalogue)
    report("done", 1.0)
    diagnosis = Diagnosis(
        arrangement=arrangement, catalogue=catalogue, scores=tuple(scores), baseline=baseline, refits=tuple(refits),
        verdict=verdict,
    )  # fmt: skip
    return FeatureResult(diagnosis=diagnosis, indications=indications)


def calibrate_features(
    base: Model,
    data: Sequence[Datum],
    calibration: Sequence[CalibrationParameter],
    level: float,
    *,
    added: Sequence[AddedEffect] = (),
    extra: Sequence[Extra] = (),
    run_step: RunStep = compute_step,
) -> FeatureArrangement:
    """Calibrate a model, the first part of a diagnosis; level of `find_level`, others as for `diagnose_features`."""
    if added:
        known = list_effects(base, extra=extra, level=level)
        added = [item.listed_in(known) for item in added]
    return run_step("arrangement", lambda: arrange_features(base, data, calibration, added=added))


def find_level(base: Model, data: Sequence[Datum]) -> float:
    """Force that produces the measured amplitude at the first resonance [N]; 1 if the data contain no amplitude.

    Typical strengths of nonlinear effects, and their bounds, refer to this force.
    """
    resonance = measure_scale(base).resonances[0]
    kinds = [(DATA_TYPES[datum.type].motions, datum) for datum in data]
    moved = [motion for motions, datum in kinds if motions is not None for motion in motions(base, datum)]
    levels = [size / resonance.amplitude(row) for row, size in moved if resonance.amplitude(row)]
    return max(levels, default=1.0)


def list_indications(model: Model, data: Sequence[Datum]) -> tuple[Indication, ...]:
    """Indications of the data relative to a model, clearest first."""
    result: list[Indication] = []
    for name in dict.fromkeys(datum.type for datum in data):
        kind = DATA_TYPES[name]
        own = [datum for datum in data if datum.type == name]
        if kind.indications is not None:
            result += kind.indications(model, own, [kind.predict(model, datum) for datum in own])
    return tuple(sorted(result, key=lambda indication: -abs(indication.difference)))


@dataclass(frozen=True, kw_only=True, eq=False)
class FeatureTest(HeldOutTest):
    """Test of effects: they lower the held-out error, differ from their neutral value, and explain the indications.

    Parameters
    ----------
    data
        All data.
    indications
        Indications of the data relative to the model without a further effect.
    """

    data: Sequence[Datum]
    indications: Sequence[Indication]

    def passes(self, refit: Refit) -> bool:
        """Whether the excess of the error falls significantly, with a significant strength of the effect."""
        return super().passes(refit) and not refit.may_vanish

    def is_surely_better(self, before: Refit, after: Refit) -> bool:
        """Whether the held-out chi^2 falls significantly, with standard deviations scaled to the remaining residual."""
        fall = before.n_held_out * (before.held_out_reduced_chi2 - after.held_out_reduced_chi2)
        return fall > MIN_STANDARD_ERRORS**2 * max(1.0, after.held_out_reduced_chi2)

    def explains(self, refit: Refit) -> bool:
        """Whether little remains of the error and of every clear indication."""
        return super().explains(refit) and self._shows(refit)

    def _shows(self, refit: Refit) -> bool:
        after = {(item.kind, item.quantity): item for item in list_indications(refit.fit.model, self.data)}
        pairs = [(item, after.get((item.kind, item.quantity))) for item in self.indications if item.is_clear]
        return all(
            now is not None and abs(now.difference) <= max(CLEAR_DEVIATION, MAX_EXCESS_LEFT * abs(was.difference))
            for was, now in pairs
        )


def _judge(
    arrangement: FeatureArrangement,
    baseline: Refit,
    refits: Sequence[Refit],
    data: Sequence[Datum],
    indications: Sequence[Indication],
    catalogue: Catalogue,
) -> Verdict:
    """Verdict of the test; "unknown" if clear indications remain that no effect explains."""
    # Errors are in standard deviations, so that noise has an error of one.
    test = FeatureTest(baseline=baseline, floor=np.ones(1), data=data, indications=indications)
    finding, effects = test.decide(refits)
    clear = [item for item in indications if item.is_clear]
    nearest = next((item for item in refits if test.passes(item)), None)
    off = arrangement.find_worst_frequency((nearest or baseline).fit)
    if off is not None and abs(off[1]) > MAX_ERROR_SIZES[0]:
        finding, effects = Finding.NOT_CLOSE, []
    elif finding is Finding.NOTHING and clear:
        finding = Finding.UNKNOWN
    units = {item.name: item.parameters[0].unit for item in catalogue.candidates}
    reason = _describe_finding(finding, baseline, nearest, clear, off)
    return Verdict(
        finding=finding, effects=effects, baseline=baseline, detectable={}, units=units, reason=reason,
        nearest=nearest if finding is Finding.UNKNOWN else None,
    )  # fmt: skip


def _describe_finding(
    finding: Finding,
    baseline: Refit,
    nearest: Refit | None,
    clear: Sequence[Indication],
    off: tuple[float, float] | None,
) -> str:
    """Finding in words, where no effect is named."""
    size = f"the held-out features differ from the model by {baseline.held_out_error:.2g} standard deviations"
    if finding is Finding.NOTHING:
        return (
            f"Nothing is missing beyond the deviations of the features: {size}, and no candidate lowers this "
            "significantly."
        )
    shown, causes = _describe_clearest(clear) or size, name_causes(clear)
    signs = f" {causes[0].upper()}{causes[1:]}." if causes else ""
    if finding is Finding.NOT_CLOSE and off is not None:
        far = f"its resonance near {off[0]:.3g} Hz is {100 * off[1]:+.2g} % off, which no known effect explains"
        return f"The model is not close enough to be diagnosed: {far}. The data show: {shown}.{signs}"
    missing = "Something is missing, and it is none of the known effects."
    if nearest is not None:
        errors = f"from {baseline.held_out_error:.3g} to {nearest.held_out_error:.3g} standard deviations"
        missing = (
            "Something is missing, and no known effect alone explains it: "
            f"{nearest.name} comes nearest, and lowers the held-out error {errors}."
        )
    return f"{missing}{signs} The data show: {shown}."


def _describe_clearest(clear: Sequence[Indication]) -> str:
    """Sentence with the clearest indication of each kind, and further ones up to `MIN_INDICATIONS`."""
    first = list({item.kind: item for item in reversed(clear)}.values())
    listed = [*first, *(item for item in clear if item not in first)][: max(MIN_INDICATIONS, len(first))]
    more = len(clear) - len(listed)
    return "; ".join(item.sentence for item in clear if item in listed) + (f"; and {more} more signs" if more else "")
