"""The stages of a model: nominal, with the values of the case, fitted, with the named effect."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from diagnosis.fit.problem import Refit
from diagnosis.fit.weighting import leave_out_model_error
from figure.waterfall import WaterfallStep
from geometry.plain_number import format_number
from study.compare.run import DataSet
from study.diagnose.history import Errors, History
from study.diagnose.round import Round, summarise_errors


@dataclass(frozen=True, kw_only=True, eq=False)
class FitStage:
    """A fitted model.

    Parameters
    ----------
    name
        Name for tables and figures.
    refit
        Fit with its prediction and errors.
    """

    name: str
    refit: Refit


def list_stages(result: Round) -> list[FitStage]:
    """Nominal; if the case has fitted values, with these; fitted in this round; with the named effect.

    All are tested on the held-out data in the same way, with the covariance of this round.
    """
    baseline, best = result.diagnosis.baseline, result.best
    listed = [FitStage(name="nominal", refit=result.uncalibrated)]
    if result.setup.added or result.setup.calibrated:
        as_it_is = result.run_step(
            "as it is", lambda: result.diagnosis.arrangement.test_uncalibrated(result.setup.complete)
        )
        listed += [FitStage(name="as in the case", refit=as_it_is), FitStage(name="refitted", refit=baseline)]
    else:
        listed.append(FitStage(name="calibrated", refit=baseline))
    if best is not None and best.effect is not None:
        listed.append(FitStage(name=f"with {best.label}", refit=best))
    return listed


def list_data_sets(result: Round, stage: FitStage) -> list[DataSet]:
    """Training and held-out data with predictions of a stage, weighted by noise and stated errors alone."""
    arrangement, fit = result.diagnosis.arrangement, stage.refit.fit
    held_out = arrangement.held_out
    predicted = result.run_step(f"held out, {stage.name}", lambda: held_out.predict(fit.model, fit.prediction))
    beside = ((arrangement.train, fit.prediction), (held_out, predicted))
    return [DataSet(comparison=leave_out_model_error(one), prediction=prediction) for one, prediction in beside]


def make_waterfall(result: Round, history: History) -> list[WaterfallStep]:
    """Errors of each step: those in the history, the model fitted in this round, and the proposed effect."""
    best, present = result.best, [item.effect.name for item in result.setup.added]
    steps = list_known_errors(
        history, present, summarise_errors(result.uncalibrated), summarise_errors(result.diagnosis.baseline)
    )
    if best is not None and best.effect is not None:
        steps.append(make_step(f"+ {best.label}", summarise_errors(best), proposed=True))
    return steps


def list_known_errors(history: History, present: Sequence[str], drawn: Errors, now: Errors) -> list[WaterfallStep]:
    """Errors of the nominal model, of each step in the history, and of the fitted model.

    Parameters
    ----------
    history
        History of the case.
    present
        Names of the effects that were added.
    drawn, now
        Errors of the nominal model, and with all its values fitted.
    """
    steps = [make_step("nominal", drawn)]
    last = history.last_diagnosis
    known = [step for step in history.active_steps if step.after and step.drawn and step.effect in present]
    if not present:
        steps.append(make_step("calibrated", now))
    else:
        if last is not None and last.accepted is not None:
            steps.append(make_step("calibrated", last.accepted))
        steps += [make_step(f"+ {step.effect}", step.after) for step in known[:-1] if step.after]
        # Effects without a step in the history belong to the last step.
        rest = [name for name in present if name not in [step.effect for step in known[:-1]]]
        steps.append(make_step("".join(f"+ {name} " for name in rest).strip(), now))
    return steps


def describe_fall(steps: Sequence[WaterfallStep]) -> str:
    """The held-out error from the first step to the last, in words."""
    first, last = steps[0].held_out, steps[-1].held_out
    if not (isfinite(first) and isfinite(last)):
        return "the held-out error is unknown"
    return f"held-out error from {format_number(100 * first, 3)} to {format_number(100 * last, 3)} %"


def make_step(name: str, values: Errors, proposed: bool = False) -> WaterfallStep:
    """One bar of the chart of errors."""
    return WaterfallStep(name=name, proposed=proposed, **vars(values))
