r"""Which effects could explain what a fit leaves of time records: each at finite strength, the fitted numbers out.

As in `diagnosis.screening`, with the residual in units of each sensor: with :math:`r_\perp` and :math:`d_\perp` the
residual and an effect's change across what the fitted numbers can do, the squared error falls by the share
:math:`(d_\perp \cdot r_\perp)^2 / (|d_\perp|^2 |r|^2)`. It is no test: what is left is coloured.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from correlation.record_propagator import propagator
from diagnosis.effect.candidate import Effect, Untestable
from diagnosis.record.arrangement import RecordArrangement
from diagnosis.record.comparison import Matrix, Vector
from diagnosis.record.fit import record_jacobian
from geometry.errors import InputError

#: Share of an effect that must be left by the fitted numbers for it to be told from them: below, it is numerical error.
LEFT = 1e-4
#: Instead of the squared error of a model without any.
TINY = 1e-300
#: Least strength to try, as a share of the typical one.
LEAST = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordScore:
    """How well one effect explains the residual, to first order.

    Parameters
    ----------
    effect
        Which.
    strength
        Where the squared error would be least, within the bounds [its unit].
    gain
        By what share the squared error would fall [-].
    absorbed
        Share of the effect that the fitted numbers absorb, 1 - |d_perp| / |d|.
    direction
        d_perp / |d_perp|, shape (m,); zero if it is all absorbed.
    size
        Root mean square of d_perp per unit of strength: error that is left without the effect [1/its unit].
    """

    effect: Effect
    strength: float
    gain: float
    absorbed: float
    direction: Vector
    size: float


def testable(
    arrangement: RecordArrangement, effects: Sequence[Effect]
) -> tuple[tuple[Effect, ...], tuple[Untestable, ...]]:
    """Effects that a march through time can take, and the others with the reason."""
    found, left = [], []
    for effect in effects:
        unknowns = arrangement.unknowns([effect])
        ends = [
            np.array([*arrangement.fit.values, strength, *(each.vanishes for each in effect.parameters[1:])])
            for strength in (effect.parameters[0].vanishes, effect.parameters[0].typical)
        ]
        try:
            for driven in arrangement.train.drives:
                before, after = (propagator(unknowns.compose(end), driven.sensors, driven.record.step) for end in ends)
                before.rate(after, 1.0)
        except InputError as reason:
            left.append(Untestable(name=effect.name, reason=str(reason)))
        else:
            found.append(effect)
    return tuple(found), tuple(left)


def screen_records(
    arrangement: RecordArrangement, effects: Sequence[Effect], report: Callable[[int, int], None] | None = None
) -> list[RecordScore]:
    """Score effects, best first.

    Parameters
    ----------
    arrangement
        Fitted.
    effects
        Candidates.
    report
        Called with the number done and the number of all.
    """
    fit = arrangement.fit
    columns = np.linalg.norm(fit.jacobian, axis=0)
    basis = np.linalg.qr(fit.jacobian[:, columns > 0] / columns[columns > 0])[0]
    scores = []
    for number, effect in enumerate(effects):
        scores.append(_score(arrangement, effect, basis))
        if report is not None:
            report(number + 1, len(effects))
    return sorted(scores, key=lambda score: -score.gain)


def _score(arrangement: RecordArrangement, effect: Effect, basis: Matrix) -> RecordScore:
    """Look where the derivative says that the squared error is least, at most at typical strength."""
    fit, parameter = arrangement.fit, effect.parameters[0]
    unknowns = arrangement.unknowns([effect])
    values = np.array([*fit.values, *(each.vanishes for each in effect.parameters)])
    slope = record_jacobian(arrangement.train, unknowns, values, fit.starts, first=len(fit.values))[:, 0]
    residual = _across(basis, fit.residual)
    whole, across = float(np.linalg.norm(slope)), _across(basis, slope)
    left = float(np.linalg.norm(across)) / whole if whole else 0.0
    nothing = RecordScore(
        effect=effect, strength=parameter.vanishes, gain=0.0, absorbed=1 - left, direction=np.zeros_like(residual),
        size=0.0,
    )  # fmt: skip
    if left < LEFT:
        return nothing
    away, gain = _least(effect, across, residual)
    typical = abs(parameter.typical - parameter.vanishes)
    step = float(np.clip(away, -typical, typical))
    if abs(step) > LEAST * typical:
        # The fitted numbers make up for what they can, or all would be lost in the shift of a resonance.
        made_up = -np.linalg.lstsq(fit.jacobian, slope, rcond=1e-12)[0] * step
        moved = values + np.array([*made_up[: len(fit.values)], step, *np.zeros(len(effect.parameters) - 1)])
        there = arrangement.train.residual(
            unknowns.compose(unknowns.clipped(moved)), fit.starts + made_up[len(fit.values) :]
        )
        if there is not None:
            change = _across(basis, fit.residual - there) / step
            further, more = _least(effect, change, residual)
            if more >= gain:
                away, gain, across = further, more, change
    size = float(np.linalg.norm(across))
    return RecordScore(
        effect=effect, strength=parameter.vanishes + away, gain=gain / max(float(fit.residual @ fit.residual), TINY),
        absorbed=1 - left, direction=across / size, size=size / np.sqrt(len(residual)),
    )  # fmt: skip


def _across(basis: Matrix, vector: Vector) -> Vector:
    return np.asarray(vector - basis @ (basis.T @ vector))


def _least(effect: Effect, across: Vector, residual: Vector) -> tuple[float, float]:
    """Strength beyond the vanishing one where the squared error is least, and by how much it falls."""
    parameter, steepness = effect.parameters[0], float(across @ across)
    step = float(across @ residual) / steepness
    step = float(np.clip(step, parameter.lower - parameter.vanishes, parameter.upper - parameter.vanishes))
    return step, max(2 * step * float(across @ residual) - step**2 * steepness, 0.0)
