"""Conditions for effects to be named, by the statistics of one kind of data."""

from collections.abc import Sequence
from typing import Protocol

from diagnosis.decision.verdict import Finding
from diagnosis.fit.problem import Refit


class NamingTest(Protocol):
    """Conditions for refits to be named, by the statistics of one kind of data."""

    def passes(self, refit: Refit) -> bool:
        """Whether an effect is significant."""
        ...

    def explains(self, refit: Refit) -> bool:
        """Whether little is left beside an effect that passes, so that it stands in for no other."""
        ...

    def choose(self, passed: Sequence[Refit]) -> list[Refit]:
        """The best of the effects that pass, which come best first, and those that the data cannot tell from it."""
        ...

    def is_unexplained(self) -> bool:
        """Whether something is missing though no effect passes."""
        ...


def apply_test(test: NamingTest, refits: Sequence[Refit]) -> tuple[Finding, list[Refit]]:
    """Finding, and the effects that it names, from refits in order, best first."""
    passed = [refit for refit in refits if test.passes(refit)]
    if not passed:
        return (Finding.UNKNOWN if test.is_unexplained() else Finding.NOTHING), []
    if not test.explains(passed[0]):
        return Finding.UNKNOWN, []
    chosen = test.choose(passed)
    return (Finding.AMBIGUOUS if len(chosen) > 1 else Finding.MISSING), chosen
