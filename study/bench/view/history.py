"""View of the history of a case: steps that can be undone, and the errors of each step."""

from collections.abc import Sequence
from math import isfinite
from typing import Any

from study.diagnose.history import Errors, History
from study.diagnose.stages import list_known_errors


def show_history(history: History) -> list[dict[str, Any]]:
    """List the steps, oldest first; `back` is the number of `undo` calls that undo an active step, otherwise zero."""
    active_steps = history.active_steps
    # By identity: active steps are elements of `history.steps`, not copies.
    back = {id(step): len(active_steps) - place for place, step in enumerate(active_steps)}
    return [
        {
            "what": step.what,
            "when": step.when,
            "effect": step.effect,
            "values": [str(pair[0]) for pair in step.values.values()],
            "sentence": step.sentence,
            "before": None if step.before is None else step.before.document,
            "after": None if step.after is None else step.after.document,
            "diff": list(step.diff)[2:],
            "back": back.get(id(step), 0),
        }
        for step in history.steps
    ]


def show_errors(history: History, present: Sequence[str], drawn: Errors, now: Errors) -> list[dict[str, Any]]:
    """List the errors of training and held-out data after each step: nominal, calibrated, and with each effect.

    Parameters
    ----------
    history
        History of the case.
    present
        Names of the effects in the case.
    drawn, now
        Errors of the nominal model, and of the model with all values refitted.
    """
    return [vars(step) for step in list_known_errors(history, present, drawn, now)]


def list_numbers(before: Errors | None, after: Errors | None) -> dict[str, float]:
    """List the errors of a step as named numbers, without unknown ones."""
    sides = {"before": before, "after": after}
    return {
        f"{words} error {side} [%]": 100 * value
        for side, item in sides.items()
        if item is not None
        for words, value in (("training", item.training), ("held-out", item.held_out))
        if isfinite(value)
    }
