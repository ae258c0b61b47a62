"""Starts of fits far from the vanishing strength, for effects whose derivative there says little about them.

A contact that slips at the vanishing strength may stick at a larger one, and no derivative sees the way there. Nor does
one see what twice the stiffness of a line does to peaks that calibration parameters have moved already.
"""

from collections.abc import Sequence

import numpy as np

from diagnosis.candidate.effect import Effect, EffectParameter, changes_joints
from diagnosis.fit.calibration import Vector
from diagnosis.fit.fit_parameter import Values, make_start
from diagnosis.fit.problem import Problem
from diagnosis.fit.refit import MOST_RUGGED, is_rugged


def list_far_starts(problem: Problem, effects: Sequence[Effect]) -> list[tuple[Effect, Values]]:
    """The fitted values with far strengths of the first few effects that are ratios of joints, or act through slip."""
    starts: list[tuple[Effect, Values]] = []
    model = problem.fit.model
    far = [each for each in effects if is_rugged(each) or (each.parameters[0].is_ratio and changes_joints(each, model))]
    for effect in far[:MOST_RUGGED]:
        strengths = list_far_strengths(effect.parameters[0])
        starts += [(effect, make_start(problem.fit.values, effect, strength)) for strength in strengths]
    return starts


def list_far_strengths(parameter: EffectParameter) -> Vector:
    """Both bounds of a strength and what is halfway to them, of a ratio in logarithms, shape (4,) [its unit]."""
    bounds, vanishes = np.array([parameter.lower, parameter.upper]), parameter.vanishes
    halfway = np.sqrt(bounds * vanishes) if parameter.is_ratio else (bounds + vanishes) / 2
    return np.concatenate([bounds, halfway])
