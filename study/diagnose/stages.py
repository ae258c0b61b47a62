"""The stages of a model on its way to the measurements: as drawn, as the case says, fitted, with each effect."""

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.fit.problem import Refit
from figure.waterfall import WaterfallStep
from study.diagnose.history import Errors, History
from study.diagnose.round import Round, as_drawn, errors


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage:
    """A fitted model.

    Parameters
    ----------
    name
        In words.
    refit
        With its prediction.
    """

    name: str
    refit: Refit


def stages(of: Round) -> list[Stage]:
    """As drawn; if the case holds fitted values, as it says; fitted in this round; with the effect that is named.

    Each is tested on the held-out data in the same way, with the covariance of this round.
    """
    found = [Stage(name="as drawn", refit=of.drawn)]
    present = of.diagnosis.before
    if of.setup.added or of.setup.calibrated:
        found += [
            Stage(name="as the case says", refit=of.keep("as it is", lambda: as_it_is(of))),
            Stage(name="fitted anew", refit=present),
        ]
    else:
        found.append(Stage(name="calibrated", refit=present))
    best = of.best
    if best is not None and best.effect is not None:
        found.append(Stage(name=f"with {best.effect.name}", refit=best))
    return found


def as_it_is(of: Round) -> Refit:
    """The case with the factors and effects that its file holds, tested like a fitted one."""
    return as_drawn(of.diagnosis.arrangement, of.setup.complete)


def waterfall(of: Round, history: History) -> list[WaterfallStep]:
    """Errors of each step: those that the history knows, the model fitted in this round, and what is proposed."""
    now = errors(of.diagnosis.before)
    steps = [_step("as drawn", errors(of.drawn))]
    told = history.last_diagnosis
    known = [step for step in history.standing if step.after is not None and step.drawn is not None]
    present = [each.effect.name for each in of.setup.added]
    known = [step for step in known if step.effect in present]
    if not present:
        steps.append(_step("calibrated", now))
    else:
        if told is not None and told.accepted is not None:
            steps.append(_step("calibrated", told.accepted))
        for step in known[:-1]:
            assert step.after is not None
            steps.append(_step(f"+ {step.effect}", step.after))
        # Whatever the history does not know of is in the last one.
        rest = [name for name in present if name not in [step.effect for step in known[:-1]]]
        steps.append(_step("".join(f"+ {name} " for name in rest).strip(), now))
    if of.best is not None and of.best.effect is not None:
        steps.append(_step(f"+ {of.best.effect.name}", errors(of.best), proposed=True))
    return steps


def falls(steps: Sequence[WaterfallStep]) -> str:
    """The held-out error from the first step to the last, in words."""
    return f"held-out error from {100 * steps[0].held_out:.3g} to {100 * steps[-1].held_out:.3g} %"


def _step(name: str, of: Errors, proposed: bool = False) -> WaterfallStep:
    return WaterfallStep(
        name=name,
        training=of.training,
        held_out=of.held_out,
        training_chi2=of.training_chi2,
        held_out_chi2=of.held_out_chi2,
        proposed=proposed,
    )
