"""View of candidate effects: physics, gain or probability, strength, and effects with similar changes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from diagnosis.candidate.effect import EffectParameter
from diagnosis.screening import Score
from study.case.added import format_parameter
from study.diagnose.advice import choose_advice
from study.diagnose.doubt import list_doubts, list_notes
from study.diagnose.report import describe_threshold, format_headline
from study.diagnose.round import Round
from study.diagnose.table import Row, format_interval, list_rows

#: Smallest similarity (cosine) of effects that the page names as confused, and largest number of names.
CONFUSED, MOST = 0.6, 3


def show_scores(scores: Sequence[Score]) -> list[dict[str, Any]]:
    """Make the view of the candidates of a screening, best first, with numbers to first order."""
    confused = find_confused(scores)
    return [
        _show_candidate(score, confused) | {
            "gain": score.gain,
            "is_fitted": False,
            "strength": _format_strength(score),
            "value": _list_values(score.strength, score.effect.parameters),
        }
        for score in scores
    ]  # fmt: skip


def show_diagnosis(result: Round) -> dict[str, Any]:
    """Make the view of a diagnosis: verdict, and candidates: first named, then fitted, then other effects."""
    verdict = result.diagnosis.verdict
    scores = {score.effect.name: score for score in result.diagnosis.scores}
    confused = find_confused(result.diagnosis.scores)
    order = [entry.effect.name for entry in verdict.effects if entry.effect is not None]
    # The verdict contains the probability of a single effect.
    chance = dict(zip(order, verdict.probabilities, strict=False)) if len(order) > 1 else {}
    return {
        "finding": verdict.finding.value,
        "sentence": format_headline(result),
        "doubts": [*list_doubts(result), *list_notes(result)],
        "advice": choose_advice(result),
        "threshold": describe_threshold(result),
        "chance": float(result.diagnosis.thresholds.gain),
        "candidates": [_show_fitted(row, scores[row.effect.name], confused, chance) for row in list_rows(result)],
        "untestable": [{"name": item.name, "reason": item.reason} for item in result.diagnosis.catalogue.untestable],
    }


def find_confused(scores: Sequence[Score]) -> dict[str, list[list[Any]]]:
    """Find for each effect the most similar ones: their names and cosines."""
    seen = [score for score in scores if score.direction.any()]
    if not seen:
        return {}
    directions = np.array([score.direction for score in seen])
    cosines = np.abs(directions @ directions.T)
    np.fill_diagonal(cosines, 0.0)
    result = {}
    for score, line in zip(seen, cosines, strict=True):
        near = [int(other) for other in np.argsort(-line)[:MOST] if line[other] > CONFUSED]
        result[score.effect.name] = [[seen[other].effect.name, round(float(line[other]), 3)] for other in near]
    return result


def _show_candidate(score: Score, confused: Mapping[str, list[list[Any]]]) -> dict[str, Any]:
    effect = score.effect
    return {
        "name": effect.name,
        "kind": effect.kind,
        "physics": effect.physics,
        "signature": effect.signature,
        "absorbed": score.absorbed,
        "confused": confused.get(effect.name, []),
        "expected": score.gain,
        "probability": None,
        "held_out": None,
        "is_named": False,
    }


def _show_fitted(
    row: Row, score: Score, confused: Mapping[str, list[list[Any]]], chance: Mapping[str, float]
) -> dict[str, Any]:
    is_fitted = row.gain is not None
    return _show_candidate(score, confused) | {
        "gain": row.fall,
        "is_fitted": is_fitted,
        "is_named": row.named,
        "strength": row.in_words,
        "probability": chance.get(row.effect.name),
        "held_out": None if row.errors is None else row.errors.held_out,
        "value": [] if is_fitted else _list_values(score.strength, row.effect.parameters),
    }


def _format_strength(score: Score) -> str:
    parameter = score.effect.parameters[0]
    typical = abs(parameter.typical - parameter.vanishes)
    return format_interval(score.strength, typical / score.size if score.size else np.inf, parameter)


def _list_values(strength: float, parameters: Sequence[EffectParameter]) -> list[str]:
    """List values for adding an effect that was not fitted: strength to first order, typical values of the others."""
    rest = [parameter.typical for parameter in parameters[1:]]
    return [format_parameter(value, parameter) for value, parameter in zip([strength, *rest], parameters, strict=True)]
