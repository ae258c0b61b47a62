"""Report of a plan: table and JSON document."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.plan import CONFUSED, Plan
from diagnosis.screening import Score
from geometry.plain_number import format_number
from study.console import WIDTH
from study.diagnose.table import format_strength

#: Largest ratio of detectable to typical strength of an effect that is called clear, and of one called weak [-].
CLEAR, WEAK = 1.0, 10.0


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanResult:
    """Result of the command.

    Parameters
    ----------
    title
        Title of the case.
    tests
        Planned tests.
    plan
        Plan: detectability and confusion of the effects.
    noise
        Relative noise as the user typed it.
    added
        Names of effects that the case already has.
    files
        Written files.
    """

    title: str
    tests: tuple[NextTest, ...]
    plan: Plan
    noise: str
    added: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()

    @property
    def n_state(self) -> int:
        """Number of measured steady states [-]."""
        return sum(len(item.levels) * len(item.frequencies) * len(item.sweeps) * item.n_repeat for item in self.tests)

    @property
    def headline(self) -> str:
        """Sentence on how many effects the tests would detect."""
        plan = self.plan
        clear = sum(plan.relative(score) <= CLEAR for score in plan.scores)
        weak = sum(CLEAR < plan.relative(score) <= WEAK for score in plan.scores)
        lone = sum(plan.relative(score) <= CLEAR and not plan.confused_with(score) for score in plan.scores)
        return (
            f"Of {len(plan.scores)} effects these tests would detect {clear} at strengths that matter, {lone} of them "
            f"without confusion with another; {weak} only at up to ten times that strength, "
            f"{len(plan.scores) - clear - weak} not at all."
        )

    def text(self) -> str:
        """Text of the result for the console."""
        return "\n".join([*self._lines(), "", *map(str, self.files)])

    def document(self) -> dict[str, Any]:
        """Document for JSON; strengths in SI."""
        plan, detectable = self.plan, self.plan.detectable
        return {
            "title": self.title,
            "sentence": self.headline,
            "threshold": plan.threshold,
            "noise": self.noise,
            "states": self.n_state,
            "tests": [_describe_test(item) for item in self.tests],
            "effects": [
                {
                    "effect": score.effect.name,
                    "kind": score.effect.kind,
                    "unit": score.effect.parameters[0].unit,
                    "smallest_detectable": detectable[score.effect.name],
                    "typical": abs(score.effect.parameters[0].typical - score.effect.parameters[0].vanishes),
                    "smallest_over_typical": plan.relative(score),
                    "absorbed_by_calibration": score.absorbed,
                    "confused_with": plan.confused_with(score),
                }
                for score in plan.scores
            ],
            "untestable": [{"effect": item.name, "reason": item.reason} for item in plan.catalogue.untestable],
            "files": [str(file) for file in self.files],
        }

    def _lines(self) -> Iterator[str]:
        yield self.title
        yield ""
        yield from wrap(self.headline, WIDTH)
        for test in self.tests:
            levels = ", ".join(format_number(level, 3) for level in test.levels)
            ends = f"{format_number(test.frequencies[0], 5)} to {format_number(test.frequencies[-1], 5)} Hz"
            yield f"  {test.configuration}: {len(test.frequencies)} frequencies from {ends} at levels {levels}"
        yield (
            f"  sensors {', '.join(self.tests[0].sensors)}; {self.tests[0].n_repeat} repeats, noise {self.noise}; "
            f"{self.n_state} steady states"
        )
        if self.added:
            yield f"  in the case already: {', '.join(self.added)}"
        yield ""
        seen = [score for score in self.plan.scores if np.isfinite(self.plan.relative(score))]
        width = max((len(score.effect.name) for score in seen), default=6)
        yield f"  {'effect':<{width}}  {'smallest':>12}  {'typical':>12}  {'looks like'}"
        for score in seen:
            alike = self.plan.confused_with(score)
            more = f" and {len(alike) - 2} more" if len(alike) > 2 else ""
            strengths = "  ".join(f"{item:>12}" for item in _format_strengths(self.plan, score))
            yield f"  {score.effect.name:<{width}}  {strengths}  {', '.join(alike[:2])}{more}".rstrip()
        yield "  smallest: strength that about half of such campaigns would name; typical: one that matters, such as a"
        yield f"  mass that shifts a resonance by 0.5 %; looks like: |cos| of the changes above {CONFUSED:g}"
        hidden = [score.effect.name for score in self.plan.scores if not np.isfinite(self.plan.relative(score))]
        if hidden:
            yield from wrap(f"Not detectable: {', '.join(hidden)}", WIDTH, initial_indent="  ", subsequent_indent="  ")
        if self.plan.catalogue.untestable:
            yield ""
            yield "Cannot be tested:"
            yield from (f"  {item.name}: {item.reason}" for item in self.plan.catalogue.untestable)


def _format_strengths(plan: Plan, score: Score) -> tuple[str, str]:
    """Smallest detectable and typical strength, with units."""
    parameter = score.effect.parameters[0]
    values = plan.detectable[score.effect.name], abs(parameter.typical - parameter.vanishes)
    if parameter.unit == "-" and parameter.vanishes:
        return f"{format_number(100 * values[0])} %", f"{format_number(100 * values[1])} %"
    return format_strength(values[0], parameter, 2), format_strength(values[1], parameter, 2)


def _describe_test(test: NextTest) -> dict[str, Any]:
    return {
        "configuration": test.configuration, "levels": [*test.levels], "frequencies_hz": [*test.frequencies],
        "sensors": [*test.sensors], "harmonics": [*test.harmonics], "sweeps": [*test.sweeps], "repeats": test.n_repeat,
    }  # fmt: skip
