"""The criteria "response" and "force" of figure 16 as numbers, with the thresholds of the case."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from correlation.family.verdict import FamilyVerdict
from study.paper.case import CriteriaTable
from study.paper.limits import IterationLimits, compute_furthest_outside


@dataclass(frozen=True, kw_only=True)
class CriterionScore:
    """Score of a criterion.

    Parameters
    ----------
    name
        Name of the score.
    level
        Level [N].
    value, threshold
        Score, and its upper or lower bound [-].
    met
        Whether the score is within its bound.
    """

    name: str
    level: float
    value: float
    threshold: float
    met: bool


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """A criterion and its scores; without scores it was not judged."""

    scores: tuple[CriterionScore, ...]

    @property
    def met(self) -> bool | None:
        """Whether all scores are met; None without scores."""
        return all(score.met for score in self.scores) if self.scores else None

    def worst(self, name: str) -> CriterionScore:
        """Of the scores of one name, the one nearest to its threshold or furthest beyond it."""
        own = [score for score in self.scores if score.name == name]
        return min(own, key=lambda score: score.value) if name == COVERAGE else max(own, key=lambda score: score.value)


COVERAGE = "coverage"
STATIC_NORMAL, STATIC_TANGENTIAL, DYNAMIC = "static normal", "static tangential", "dynamic"


def judge_response(limits: IterationLimits, criteria: CriteriaTable) -> Criterion:
    """Coverage of the measured response at every level."""
    scores = [
        CriterionScore(
            name=COVERAGE, level=item.family.level, value=item.coverage, threshold=criteria.coverage,
            met=bool(item.coverage >= criteria.coverage),
        )
        for item in limits.response
    ]  # fmt: skip
    return Criterion(scores=tuple(scores))


def judge_forces(limits: IterationLimits, criteria: CriteriaTable) -> Criterion:
    """Static normal, static tangential and dynamic forces of all lines at every level.

    Static normal forces: the middle of both limits relative to the measured mean, as in the paper. Static tangential
    forces: the largest distance of a reading outside its limits, relative to the static normal force. Dynamic forces:
    the same distance, relative to the largest dynamic force of the direction and level.
    """
    scores = []
    for item in limits.forces:
        family = item.family
        if family.harmonic == 0 and family.sensor.endswith("_N"):
            name, threshold = STATIC_NORMAL, criteria.static_normal
            value = abs(compute_static_deviation(item))
        elif family.harmonic == 0:
            normal = _find_static_normal(limits.forces, item)
            if normal is None:
                continue
            name, threshold = STATIC_TANGENTIAL, criteria.static_tangential
            value = compute_furthest_outside(item) / normal
        else:
            name, threshold = DYNAMIC, criteria.dynamic
            value = compute_furthest_outside(item) / float(family.value.max())
        # A value that was not found is NaN and meets no criterion.
        scores.append(
            CriterionScore(
                name=name, level=family.level, value=value, threshold=threshold, met=bool(value <= threshold)
            )
        )
    return Criterion(scores=tuple(scores))


def compute_static_deviation(verdict: FamilyVerdict) -> float:
    """Middle of both limits of a static force over the measured mean, less one [-]."""
    return float(np.mean(verdict.band.value) / np.mean(verdict.family.value) - 1)


def _find_static_normal(forces: Sequence[FamilyVerdict], tangential: FamilyVerdict) -> float | None:
    """Measured mean static normal force at the line and level of a tangential one [N]; None if not measured."""
    name, level = tangential.family.sensor.removesuffix("_T") + "_N", tangential.family.level
    own = (
        item.family
        for item in forces
        if (item.family.sensor, item.family.harmonic, item.family.level) == (name, 0, level)
    )
    return next((float(np.mean(family.value)) for family in own), None)
