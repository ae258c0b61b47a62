"""Test of effects by the held-out error of time records: conditions for an effect to be named.

The residual of a record is coloured, and mostly model error, so that a nominal test would accept any effect. The excess
of the held-out error over the noise must therefore fall to `MAX_EXCESS_RATIO`, and do so throughout the records: each
block votes by (e0 - e1) / (e0 + e1), with the mean squared errors e0 and e1 before and after, and the mean vote must
exceed zero by `MIN_STANDARD_ERRORS` times its standard error.

If the noise is known, there is a second condition: an effect that leaves more than `MAX_EXCESS_LEFT` of the excess over
the noise stands in for another one, as a linear spring does for a cubic one at a single level.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from diagnosis.decision.verdict import Finding, Verdict, compute_detectable_strengths
from diagnosis.fit.problem import PerRecord, Refit
from diagnosis.screening import Score
from geometry.plain_number import format_number

#: Largest share of the excess held-out error that an effect may leave to pass.
MAX_EXCESS_RATIO = 0.8
#: Error by an effect, relative to all other errors, whose removal lowers the error by this ratio r: 1 / r^2 = 1 + x^2.
DETECTABLE_ERROR = (MAX_EXCESS_RATIO**-2 - 1) ** 0.5
#: Held-out error that counts as zero: incomplete convergence of a fit, and round-off of the integration [-].
ZERO_ERROR = 1e-6
#: Largest share of the excess held-out error that a named effect may leave, if the noise is known.
MAX_EXCESS_LEFT = 0.5
#: Least mean vote of the blocks in standard errors; below it two effects cannot be distinguished.
MIN_STANDARD_ERRORS = 4.0


@dataclass(frozen=True, kw_only=True, eq=False)
class HeldOutTest:
    """Test of effects that lower the held-out error of records with known shares of noise.

    Parameters
    ----------
    baseline
        Fit of the calibration parameters and the added effects alone.
    floor
        Share of noise in each held-out record; 0 if unknown [-].
    """

    baseline: Refit
    floor: PerRecord

    def decide(self, refits: Sequence[Refit]) -> tuple[Finding, list[Refit]]:
        """Finding, and the named effects, from refits, best first."""
        passed = [refit for refit in refits if self.passes(refit)]
        if not passed:
            return (Finding.UNKNOWN if self.is_unexplained() else Finding.NOTHING), []
        if not self.explains(passed[0]):
            return Finding.UNKNOWN, []
        chosen = self.choose(passed)
        return (Finding.AMBIGUOUS if len(chosen) > 1 else Finding.MISSING), chosen

    @property
    def noise(self) -> float:
        """Mean square share of noise [-]."""
        return float(np.mean(self.floor**2))

    def passes(self, refit: Refit) -> bool:
        """Whether the excess falls to `MAX_EXCESS_RATIO`, and significantly so."""
        excess, left = self.baseline.held_out_error**2 - self.noise, refit.held_out_error**2 - self.noise
        falls = excess > ZERO_ERROR**2 and left <= MAX_EXCESS_RATIO**2 * excess
        return bool(falls and self.is_surely_better(self.baseline, refit))

    def explains(self, refit: Refit) -> bool:
        """Whether the remaining error is mostly noise; true if the noise is unknown."""
        left = refit.held_out_error**2 - self.noise
        return not self._is_beyond_noise(refit) or bool(
            left <= MAX_EXCESS_LEFT**2 * (self.baseline.held_out_error**2 - self.noise)
        )

    def choose(self, passed: Sequence[Refit]) -> list[Refit]:
        """The best, and other effects that explain the error and are not significantly worse."""
        best, *others = passed
        return [best, *(item for item in others if self.explains(item) and not self.is_surely_better(item, best))]

    def is_surely_better(self, before: Refit, after: Refit) -> bool:
        """Whether the blocks of the held-out data vote significantly for the second fit."""
        return _is_better_by_blocks(before.blocks, after.blocks)

    def is_unexplained(self) -> bool:
        """Whether the error without an effect is at least twice the noise in mean square."""
        return self._is_beyond_noise(self.baseline)

    def _is_beyond_noise(self, refit: Refit) -> bool:
        """Whether the error is at least twice the noise in mean square; false if the noise is unknown."""
        return bool(self.noise and refit.held_out_error**2 > 2 * self.noise)


def judge_records(
    baseline: Refit,
    refits: Sequence[Refit],
    floor: PerRecord,
    scores: Sequence[Score] = (),
    units: Mapping[str, str] | None = None,
) -> Verdict:
    """Verdict by the held-out error.

    Parameters
    ----------
    baseline
        Fit of the calibration parameters and the added effects alone.
    refits
        Refits, best first.
    floor
        Share of noise in each held-out record [-].
    scores
        Scores of all candidates.
    units
        Names of "N" and "m" in a model that is not in SI, such as {"N": "V", "m": "V"} in a record in volts.
    """
    test = HeldOutTest(baseline=baseline, floor=floor)
    finding, effects = test.decide(refits)
    tried = [*(score.effect for score in scores), *(refit.effect for refit in refits)]
    given = {effect.name: effect.parameters[0].unit for effect in tried if effect is not None}
    seen = [score for score in scores if score.size]
    # Squared error that the detectable effect removes, in the units of the screening.
    enough = (DETECTABLE_ERROR * baseline.held_out_error) ** 2 * baseline.fit.n_number if seen else 0.0
    return Verdict(
        finding=finding, effects=effects, baseline=baseline, detectable=compute_detectable_strengths(seen, enough),
        units={name: rename_unit(unit, units or {}) for name, unit in given.items()},
        reason=_describe_finding(finding, test, refits),
    )  # fmt: skip


def rename_unit(unit: str, names: Mapping[str, str]) -> str:
    """Unit of SI with other names for "N" and "m"."""
    if names:
        unit = re.sub(r"\bkg\b", "N s^2/m", unit)
        unit = re.sub(r"\b[Nm]\b", lambda match: names.get(match[0], match[0]), unit)
    return unit


def _describe_finding(finding: Finding, test: HeldOutTest, refits: Sequence[Refit]) -> str:
    """Finding in words, where no effect is named."""
    best = "no candidate would lower it"
    if refits:
        best = f"with the best candidate, {refits[0].name}, it is {format_number(100 * refits[0].held_out_error)} %"
    error = f"the held-out error is {format_number(100 * test.baseline.held_out_error)} %, and {best}"
    noise = 100 * np.sqrt(test.noise)
    noise_text = f"{format_number(noise)} %"
    if finding is Finding.UNKNOWN:
        return f"Something is missing, and it is none of the known effects: the noise is {noise_text}, {error}."
    if noise:
        return f"Nothing is missing beyond the noise of {noise_text}: {error}."
    return f"No effect lowers the held-out error enough: {error}; how much of this is noise is not known."


def _is_better_by_blocks(before: Float[NDArray[np.float64], " b"], after: Float[NDArray[np.float64], " b"]) -> bool:
    """Whether the blocks vote significantly for the second."""
    if not np.isfinite(before).all():
        return bool(np.isfinite(after).all())
    if not np.isfinite(after).all():
        return False
    votes = (before - after) / np.maximum(before + after, np.finfo(float).tiny)
    return bool(votes.mean() > MIN_STANDARD_ERRORS * votes.std(ddof=1) / np.sqrt(len(votes)))
