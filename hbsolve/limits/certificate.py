"""Certificate of a limit: accuracy of its solution, and possible improvement.

At a kink a gradient norm is not informative, so the certificate takes steps: the gain predicted by the linear programme
at three radii, and the gain of the steady states there.
"""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from hbsolve.contact_motion import find_contact_status
from hbsolve.limits.local_search import LimitSide, linear_step, local_search, take_step
from hbsolve.limits.optimum import LimitKey, Optima, Optimum, continue_optimum
from hbsolve.limits.point import LimitPoint
from hbsolve.limits.problem import LimitCurve
from hbsolve.limits.sliders import multipliers

#: Radii of the steps, in lengths of the intervals.
RADII = (0.05, 0.0125, 0.003)
#: Relative loss above which the state of a neighbour, continued to this frequency, is on another branch of optima.
JUMP = 0.01


#: Certificate of one limit: entries of the arrays of `hbsolve.limits.result.ResponseLimits` by name.
Certificate: TypeAlias = dict[str, Any]


def certify(curve: LimitCurve, indices: Sequence[int], best: Optima) -> dict[LimitKey, Certificate]:
    """Certificates at the frequencies of `indices`; `best` also has the neighbours of the first and the last."""
    result = {}
    for key in ((index, side) for index in indices for side in LimitSide if (index, side) in best):
        # A single state has no other branches.
        jump = not _is_one(best, key[0]) and any(
            _jumps(curve, best, key, step) for step in (-1, 1) if (key[0] + step, key[1]) in best
        )
        result[key] = _certificate(curve.point(key[0]), best[key], key[1], jump)
    return result


def _certificate(point: LimitPoint, optimum: Optimum, side: LimitSide, jump: bool) -> Certificate:
    trial = point.trial(optimum.motion, optimum.initial_slider, optimum.residual_norm)
    linear = linear_step(point, trial, side)
    size = max(abs(trial.value), point.measure.least)
    predicted, realised = np.zeros(len(RADII)), np.zeros(len(RADII))
    for number, radius in enumerate(RADII):
        step, gain = linear.step(radius)
        predicted[number] = gain / size
        there = take_step(point, trial, linear, step) if gain > 0 else None
        realised[number] = side * (there.value - trial.value) / size if there else 0.0
    ends = np.array(optimum.starts)
    status = np.concatenate([
        find_contact_status(point.balance, trial.forces, number)
        for number, joint in enumerate(point.balance.system.joints) if joint.n_slider
    ])  # fmt: skip
    return {
        "residual_norm": optimum.residual_norm,
        "predicted": predicted,
        "realised": realised,
        "spread": float(np.ptp(ends)) / size if len(ends) else 0.0,
        "starts": len(ends),
        "n_undetermined": len(trial.undetermined),
        "drift": point.box.drift(trial.initial_slider),
        "on_bound": point.box.active(trial.initial_slider),
        "repaired": optimum.repaired,
        "jump": jump,
        "multiplier": multipliers(point.sliders, trial.motion, trial.periodic_slider, point.balance.sampling.evaluate),
        "share": np.bincount(status.ravel(), minlength=3) / status.size,
    }


def _is_one(best: Optima, index: int) -> bool:
    """Whether both limits differ by no more than `JUMP`."""
    if any((index, side) not in best for side in LimitSide):
        return False
    lower, upper = (best[index, side].value for side in LimitSide)
    return abs(upper - lower) <= JUMP * abs(upper)


def _jumps(curve: LimitCurve, best: Optima, key: LimitKey, step: int) -> bool:
    """Whether the continuation of a neighbour's state does not reach this optimum."""
    (index, side), optimum, point = key, best[key], curve.point(key[0])
    worse = JUMP * max(abs(optimum.value), point.measure.least)
    if side * (optimum.value - optimum.followed.get(step, -side * np.inf)) <= worse:
        return False
    settled = continue_optimum(curve, side, best[index + step, side], index + step, index)
    return settled is None or side * (optimum.value - local_search(point, settled, side).value) > worse
