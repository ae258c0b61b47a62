r"""Description of a recovered law from its posterior draws: a word applies if it is true for 97.5 % of the draws.

hardening, softening
    The secant stiffness at the largest amplitude is above (hardening) or below (softening) that at a third of it (or at
    the smallest) by more than a tenth of the largest secant stiffness.
gap
    A spring beyond a clearance, f = k max(u - g, 0), fits the draws of the spring force better than a power of the
    displacement, f = k u^p: the sum of squares is smaller by a factor of `BETTER`, and g is at least a tenth of the
    range. Both have two parameters, so that their sums of squares are compared directly.
asymmetry
    The spring forces for u > 0 and u < 0 differ by more than a tenth of the largest one.
dissipation
    The exponent p of W ~ A^p. Coulomb friction has W = 4 F A, p = 1; a dashpot W = pi c omega A^2, p = 2. At the onset
    of slip of an Iwan joint with uniformly distributed slider limits p = 3, and less as more cells slide (micro-slip, 2
    to 3). Drag d |v| v has W = (8/3) d omega^2 A^3, p = 3.
memory
    At least half of the work is done by the cells, which depend on the displacement history and not on velocity.

References
----------
Segalman, A four-parameter Iwan model for lap-type joints, J. Appl. Mech. 72 (2005).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.missing_law.curves import BAND, LawCurves

#: Least significant change, over the largest value [-].
MATTERS = 0.1
#: Lower amplitude of a comparison with the largest one, over the latter [-].
LOWER = 1 / 3
#: Ratio of the sums of squares of a power and of a clearance above which the clearance is accepted [-].
BETTER = 2.0
#: Least work of a dissipative law, over the work of the largest force if it were in quadrature [-].
LEAST_WORK = 0.01
#: Share of the work done by the cells above which a law has memory [-].
MOSTLY = 0.5
#: Exponents of the work: upper limit for Coulomb friction, halfway to a dashpot; ranges for a dashpot and micro-slip.
COULOMB, VISCOUS, MICRO_SLIP = 1.5, (1.6, 2.4), (1.5, 3.5)
#: Clearances (over the range) and powers that are tried [-].
CLEARANCES, POWERS = np.linspace(0.1, 0.9, 33), np.linspace(1.0, 7.0, 25)


@dataclass(frozen=True, kw_only=True)
class LawDescription:
    """Description of a law in a report.

    Parameters
    ----------
    words
        Words that apply: "hardening", "softening", "gap", "stop", "asymmetric", "dissipative", "Coulomb", "viscous",
        "micro-slip", "drag", "memory".
    sentences
        The same as sentences with numbers, and properties that the data do not determine.
    """

    words: tuple[str, ...]
    sentences: tuple[str, ...]


def describe(curves: LawCurves) -> LawDescription:
    """Describe a law by its curves."""
    words, sentences = list[str](), list[str]()
    for feature_words, feature_sentences in (
        _describe_stiffness(curves),
        _describe_gap(curves),
        _describe_sides(curves),
        _describe_work(curves),
    ):
        words += feature_words
        sentences += feature_sentences
    return LawDescription(words=tuple(words), sentences=tuple(sentences))


def _describe_stiffness(curves: LawCurves) -> tuple[list[str], list[str]]:
    grid, draws = curves.stiffness.x, curves.stiffness_draws
    lower = int(np.argmin(np.abs(grid - max(grid[0], LOWER * grid[-1]))))
    change, most = draws[:, -1] - draws[:, lower], float(np.abs(curves.stiffness.mean).max())
    low, high = np.quantile(change, BAND)
    numbers = f"from {curves.stiffness.mean[lower]:.3g} to {curves.stiffness.mean[-1]:.3g} {curves.units.stiffness}"
    if low > MATTERS * most:
        return ["hardening"], [f"hardening: its secant stiffness rises {numbers} with the amplitude"]
    if high < -MATTERS * most:
        return ["softening"], [f"softening: its secant stiffness falls {numbers} with the amplitude"]
    if low > -MATTERS * most and high < MATTERS * most:
        return [], ["its secant stiffness does not change with the amplitude"]
    return [], ["these data do not show whether it hardens or softens"]


def _describe_gap(curves: LawCurves) -> tuple[list[str], list[str]]:
    x, reach = curves.spring.x, float(np.abs(curves.spring.x).max())
    sides = []
    for sign in (1.0, -1.0):
        at = sign * x >= 0
        force = sign * curves.spring_draws[:, at]
        if not curves.sees_even:
            force = (curves.spring_draws[:, at] * sign - curves.spring_draws[:, ::-1][:, at] * sign) / 2
        sides.append(_find_clearance(np.abs(x[at]) / reach, force))
    clearances = [clearance for clearance in sides if clearance is not None]
    if not clearances:
        return [], []
    if not curves.sees_even:
        where = f"abs(u) = {clearances[0] * reach:.3g} {curves.units.motion}"
        return ["gap"], [f"a clearance, on one side or on both: hardly any force up to {where}, and a spring beyond"]
    where = " and ".join(
        f"u = {sign * clearance * reach:.3g} {curves.units.motion}"
        for sign, clearance in zip((1, -1), sides, strict=True)
        if clearance is not None
    )
    word = "gap" if len(clearances) == 2 else "stop"
    what = "a clearance on both sides" if word == "gap" else "a stop on one side"
    return [word], [f"{what}: hardly any force up to {where}, and a spring beyond"]


def _find_clearance(x: Float[NDArray[np.float64], " n"], force: Float[NDArray[np.float64], "d n"]) -> float | None:
    """Clearance over the range of a side, median of the draws; None unless it fits better than a power law."""
    beyond = np.maximum(x - CLEARANCES[:, None], 0.0)
    power = x ** POWERS[:, None]
    left_gap, left_power = _compute_residual_sums(force, beyond), _compute_residual_sums(force, power)
    pushes = force[:, np.argmax(x)] > 0
    is_gap = (left_gap.min(axis=1) * BETTER < left_power.min(axis=1)) & pushes
    if np.mean(is_gap) < BAND[1]:
        return None
    return float(np.median(CLEARANCES[left_gap.argmin(axis=1)]))


def _compute_residual_sums(
    force: NDArray[np.float64], shapes: NDArray[np.float64]
) -> Float[NDArray[np.float64], "d s"]:
    """Residual sums of squares of each force, fitted by each shape with the best factor, shape (d, s)."""
    along = force @ shapes.T
    return np.asarray((force**2).sum(axis=1)[:, None] - along**2 / (shapes**2).sum(axis=1))


def _describe_sides(curves: LawCurves) -> tuple[list[str], list[str]]:
    if not curves.sees_even:
        return [], ["these data do not show whether both sides are equal: measure the mean or the second harmonic"]
    even = (curves.spring_draws + curves.spring_draws[:, ::-1]) / 2
    most = float(np.abs(curves.spring.mean).max())
    low, high = np.quantile(even[:, -1], BAND)
    if low > MATTERS * most or high < -MATTERS * most:
        left = f"{even[:, -1].mean():.3g} {curves.units.force}"
        return ["asymmetric"], [f"asymmetric: the forces of both sides add up to {left}"]
    return [], []


def _describe_work(curves: LawCurves) -> tuple[list[str], list[str]]:
    grid, draws = curves.work.x, curves.work_draws
    whole = np.pi * grid[-1] * max(float(np.abs(loop.force.mean).max()) for loop in curves.loops)
    if not (np.quantile(draws[:, -1], BAND[0]) > LEAST_WORK * whole):
        return [], ["these data show no dissipation"]
    lower = int(np.argmin(np.abs(grid - max(grid[0], LOWER * grid[-1]))))
    if not (np.quantile(draws[:, lower], BAND[0]) > 0) or lower == len(grid) - 1:
        return ["dissipative"], [
            "it dissipates energy; these data do not show how its work per cycle grows with the amplitude"
        ]
    # A few draws may have no work.
    ends = np.maximum(draws[:, [lower, -1]], np.finfo(float).tiny)
    exponent = np.log(ends[:, 1] / ends[:, 0]) / np.log(grid[-1] / grid[lower])
    low, high = np.quantile(exponent, BAND)
    words, sentence = (
        ["dissipative"],
        f"its work per cycle grows with the amplitude to the power {np.median(exponent):.2g}",
    )
    has_memory = bool(np.quantile(curves.memory_share, BAND[0]) > MOSTLY)
    has_none = bool(np.quantile(curves.memory_share, BAND[1]) < MOSTLY)
    if has_memory:
        words.append("memory")
        sentence += "; it depends on the history (hysteresis)"
    kind = None
    if high < COULOMB:
        kind = "Coulomb"
    elif low > VISCOUS[0] and high < VISCOUS[1] and has_none:
        kind = "viscous"
    elif low > VISCOUS[1] and has_none:
        kind = "drag"
    elif has_memory and low > MICRO_SLIP[0] and high < MICRO_SLIP[1]:
        kind = "micro-slip"
    if kind:
        words.append(kind)
        sentence += f": {kind}"
    return words, [f"{sentence} ({low:.2g} to {high:.2g})"]
