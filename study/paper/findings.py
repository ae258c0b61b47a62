"""The findings of the paper's section 5 and of its iterations, checked one by one on the replay."""

from dataclasses import dataclass

import numpy as np

from study.paper.criteria import COVERAGE, STATIC_NORMAL, compute_static_deviation
from study.paper.nonlinear import NonlinearIteration
from study.paper.replay import STEP_LABEL, Replay
from study.paper.sensitivity import Sensitivity

HOLDS, NOT = "holds", "does not hold"


@dataclass(frozen=True, kw_only=True)
class PaperClaim:
    """A claim of the paper, whether it is true here, and the numbers that show it."""

    claim: str
    verdict: str
    evidence: str


def list_findings(result: Replay) -> list[PaperClaim]:
    """All of them in the paper's order."""
    first, second, third, fourth = result.hand.nonlinear.iterations
    return [
        _judge_response_by_contact(result.sensitivity),
        _judge_forces_by_alignment(first, second, result.sensitivity),
        _judge_softening(first),
        _judge_stiffness_leads(result.sensitivity),
        _judge_deviation(third),
        _judge_all_covered(third),
        _judge_rotation(third, fourth),
    ]


def _find_largest(sensitivity: Sensitivity, quantity: str, names: tuple[str, ...]) -> tuple[str, float]:
    values = {
        name: float(np.abs(getattr(sensitivity, quantity)[sensitivity.names.index(name)]).max()) for name in names
    }
    worst = max(values, key=lambda name: values[name])
    return worst, values[worst]


CONTACT, ALIGNMENT = ("kt", "kn", "mu"), ("shift_left", "inclination_left")


def _judge_response_by_contact(sensitivity: Sensitivity) -> PaperClaim:
    (contact, by_contact), (alignment, by_alignment) = (
        _find_largest(sensitivity, "upper", item) for item in (CONTACT, ALIGNMENT)
    )
    return PaperClaim(
        claim="Limits of the response are governed by the contact parameters, unless there are gaps.",
        verdict=HOLDS if by_contact > by_alignment else NOT,
        evidence=f"changes of the peak of the upper limit: {by_contact:.1%} ({STEP_LABEL[contact]}), "
        f"{by_alignment:.1%} ({STEP_LABEL[alignment]})",
    )


def _judge_forces_by_alignment(
    first: NonlinearIteration, second: NonlinearIteration, sensitivity: Sensitivity
) -> PaperClaim:
    (contact, by_contact), (alignment, by_alignment) = (
        _find_largest(sensitivity, "normal", item) for item in (CONTACT, ALIGNMENT)
    )
    before, after = (item.force.worst(STATIC_NORMAL).value for item in (first, second))
    return PaperClaim(
        claim="Limits of the contact forces are governed by the alignment.",
        verdict=HOLDS if by_alignment > by_contact else NOT,
        evidence=f"changes of the static normal force: {by_alignment:.1%} ({STEP_LABEL[alignment]}), {by_contact:.1%} "
        f"({STEP_LABEL[contact]}); its largest deviation goes from {before:.1%} to {after:.1%} in iteration 2",
    )


def _judge_softening(first: NonlinearIteration) -> PaperClaim:
    peaks = [float(item.band.frequency[np.nanargmax(item.band.value[0])]) for item in first.limits.response]
    softens = peaks[-1] < peaks[0]
    return PaperClaim(
        claim="The lower limit softens with the excitation.",
        verdict=HOLDS if softens else NOT,
        evidence="its peak lies at "
        + ", ".join(
            f"{peak:.2f} Hz ({item.family.level:g} N)" for peak, item in zip(peaks, first.limits.response, strict=True)
        ),
    )


def _judge_stiffness_leads(sensitivity: Sensitivity) -> PaperClaim:
    changes = {name: float(np.abs(sensitivity.frequency[sensitivity.names.index(name)]).max()) for name in CONTACT}
    return PaperClaim(
        claim="kt is the most sensitive contact parameter.",
        verdict=HOLDS if max(changes, key=lambda name: changes[name]) == "kt" else NOT,
        evidence="2 % of each move the upper limit in frequency by "
        + ", ".join(f"{value:.2%} ({name})" for name, value in changes.items()),
    )


def _judge_deviation(third: NonlinearIteration) -> PaperClaim:
    worst = third.force.worst(STATIC_NORMAL)
    own = {
        item.family.sensor: compute_static_deviation(item)
        for item in third.limits.forces
        if item.family.harmonic == 0 and item.family.sensor.endswith("_N") and item.family.level == worst.level
    }
    return PaperClaim(
        claim="The static normal forces deviate by about 7 % at most.",
        verdict=HOLDS if worst.met else NOT,
        evidence=f"{worst.value:.1%} at {worst.level:g} N ("
        + ", ".join(f"{name.replace('_', ' ')} {value:+.1%}" for name, value in own.items())
        + ")",
    )


def _judge_all_covered(third: NonlinearIteration) -> PaperClaim:
    scores = [*third.response.scores, *third.force.scores]
    met = sum(score.met for score in scores)
    return PaperClaim(
        claim="One set of parameters matches all response and force limits at once (20 curves in the paper).",
        verdict=HOLDS if met == len(scores) else NOT,
        evidence=f"{met} of {len(scores)} numbers meet their threshold; least coverage of the response "
        f"{third.response.worst(COVERAGE).value:.1%}",
    )


def _judge_rotation(third: NonlinearIteration, fourth: NonlinearIteration) -> PaperClaim:
    shifts = [
        float(b.band.frequency[np.nanargmax(b.band.value[1])] - a.band.frequency[np.nanargmax(a.band.value[1])])
        for a, b in zip(third.limits.response, fourth.limits.response, strict=True)
    ]
    seen = all(np.nanargmax(item.band.value[1]) > 0 for item in fourth.limits.response)
    return PaperClaim(
        claim="A rotated damper lowers the resonances of the limits, least at 10 N.",
        # A peak at the lowest measured frequency may lie anywhere below it: the least shifted level is then unknown.
        verdict=HOLDS if max(shifts) < 0 and seen and abs(shifts[-1]) == min(map(abs, shifts)) else "holds in part",
        evidence="the peak of the upper limit moves by "
        + ", ".join(
            f"{shift:+.2f} Hz ({item.family.level:g} N)"
            for shift, item in zip(shifts, fourth.limits.response, strict=True)
        )
        + (" within the measured band" if seen else ", to or beyond the lowest measured frequency"),
    )
