"""Advice on the next test if a diagnosis leaves several explanations, in words and numbers."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from correlation.campaign.measurement import Campaign
from diagnosis.decision.verdict import Finding
from diagnosis.diagnose import Diagnosis
from diagnosis.fit.arrangement import Arrangement
from diagnosis.missing_law.place_law import MissingLaw
from diagnosis.next_test.advise import Advice, RankedTest, advise
from diagnosis.next_test.list_tests import AGAIN
from diagnosis.next_test.next_test import NextTest
from diagnosis.next_test.visibility import VisibleTest, find_visible_test
from geometry.errors import InputError
from geometry.plain_number import format_number
from hbsolve.errors import NoSteadyState

#: Number of tests that report and page show.
SHOWN = 8
#: Probabilities below which no test is reported as decisive, and no test is worth its time [-].
LIKELY, HOPELESS = 0.5, 0.01
#: Least gain of probability for which a further sensor is shown [-].
MORE = 0.02
#: Requirements of a test with another mass or preload.
APART = (
    "a campaign has one mass and one preload: make a campaign and a case of their own with this change, diagnose both, "
    "and multiply the probabilities"
)


@dataclass(frozen=True, kw_only=True, eq=False)
class NextStep:
    """Advice, or the reason why there is none.

    Parameters
    ----------
    advice
        Advice, or None.
    unit
        Unit of the levels.
    reason
        Why the advice could not be computed; empty if it was, or if there is nothing to distinguish.
    visible
        The test that shows most effects, if the measurements show none.
    """

    advice: Advice | None
    unit: str = "N"
    reason: str = ""
    visible: VisibleTest | None = None

    @property
    def sentence(self) -> str:
        """Advice in words; empty if there is none."""
        if self.visible is not None:
            count = f"{len(self.visible.seen)} of {self.visible.n_effect}"
            return f"measure {self.describe(self.visible.test)}: {count} effects of typical strength would show there"
        if self.advice is None:
            return ""
        best = self.advice.best
        share = _share(best.probability)
        if best.probability < HOPELESS:
            return "none of the further tests that were tried separates these effects"
        if best.probability < LIKELY:
            return (
                f"no single further test decides; most likely to do so: {self.describe(best.test)} (probability "
                f"{share})"
            )
        return f"measure {self.describe(best.test)}: that decides with probability {share}"

    def describe(self, test: NextTest) -> str:
        """A test in words."""
        levels = " and ".join(format_number(level, 3) for level in test.levels)
        ends = f"{format_number(test.frequencies[0], 4)} to {format_number(test.frequencies[-1], 4)} Hz"
        held = ", held out" if test.is_held_out else ""
        return f"{test.title}, {len(test.frequencies)} frequencies from {ends} at {levels} {self.unit}{held}"

    @property
    def shown(self) -> list[RankedTest]:
        """Shown tests, the advised one first, then by probability and, at equal probability, by cost."""
        if self.advice is None:
            return []
        bare = {item.test.name: item.probability for item in self.advice.ranked if item.test.place is None}
        rest = [
            item
            for item in self.advice.ranked[1:]
            # Show a further sensor only if it raises the probability.
            if item.test.place is None or item.probability > bare.get(item.test.name, 0.0) + MORE
        ]
        rest.sort(key=lambda item: (-round(item.probability, 2), item.test.minutes))
        shown = [self.advice.best, *rest][: SHOWN - 1]
        # Always show a repetition of the same tests for comparison.
        again = next((item for item in rest if item.test.name == AGAIN and item not in shown), None)
        return [*shown, *([] if again is None else [again])]

    @property
    def remark(self) -> str:
        """Further requirements of the advised test; empty without any."""
        return "" if self.advice is None or self.advice.best.test.fits_campaign else APART

    @property
    def document(self) -> dict[str, Any] | None:
        """For JSON; None if there is nothing to distinguish."""
        if self.visible is not None:
            return {"sentence": self.sentence, "test": self.visible.test.title, "would_show": [*self.visible.seen]}
        if self.advice is None:
            return {"reason": self.reason} if self.reason else None
        names = self.advice.names
        return {
            "sentence": self.sentence,
            "candidates": dict(zip(names, self.advice.probabilities, strict=True)),
            "tests": [_document_test(item, names) for item in self.advice.ranked],
        }


def find_next_step(campaign: Campaign, diagnosis: Diagnosis[Arrangement], law: MissingLaw | None) -> NextStep:
    """Advice on the next test; if the model has no steady state there, the diagnosis remains valid."""
    unit, arrangement, verdict = campaign.drive.unit, diagnosis.arrangement, diagnosis.verdict
    try:
        if verdict.finding is Finding.NOT_TESTABLE:
            return NextStep(
                advice=None, unit=unit, visible=find_visible_test(campaign, arrangement, diagnosis.catalogue)
            )
        return NextStep(advice=advise(campaign, arrangement, verdict, law), unit=unit)
    except (InputError, NoSteadyState, np.linalg.LinAlgError) as error:
        return NextStep(advice=None, unit=unit, reason=f"what to measure next could not be computed: {error}")


def format_next_tests(step: NextStep) -> Iterator[str]:
    """Lines of the report."""
    if step.reason:
        yield from ("", f"  {step.reason}")
    if step.advice is None:
        return
    yield ""
    yield f"Further tests to separate {' and '.join(step.advice.names)}:"
    for item in step.shown:
        yield f"  {100 * item.probability:5.1f} %  {item.test.minutes:4.0f} min  {item.test.title}"
    yield "  probability that the test decides, and its approximate time"
    if step.remark:
        yield f"  {step.remark}"


def _share(probability: float) -> str:
    """A probability in words; no forecast is certain."""
    return "over 99 %" if probability > 0.99 else f"{format_number(100 * probability)} %"


def _document_test(ranked: RankedTest, names: tuple[str, ...]) -> dict[str, Any]:
    test = ranked.test
    pairs = {f"{names[a]} | {names[b]}": float(ranked.separation[a, b]) for a, b in combinations(range(len(names)), 2)}
    return {
        "test": test.title,
        "probability": ranked.probability,
        "minutes": test.minutes,
        "configuration": test.configuration,
        "levels": [*test.levels],
        "frequencies_hz": [*test.frequencies],
        "sensors": [*test.sensors],
        "further_sensor_at": test.place,
        "harmonics": [*test.harmonics],
        "sweeps": [*test.sweeps],
        "repeats": test.n_repeat,
        "added_mass": None if test.added_mass is None else {"place": test.added_mass[0], "mass_kg": test.added_mass[1]},
        "preload_factor": test.preload,
        "held_out": test.is_held_out,
        "separation": pairs,
    }
