"""Progress of a diagnosis some of whose steps are kept: they are named as kept, and count for nothing in the time left.

A phase is what `diagnosis.diagnose` reports; within it steps are looked up or made. Its line opens when the first of
them is made, so that a phase that is looked up as a whole says so in place of how long it takes.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TypeVar

from diagnosis.keep import Keep
from pipeline.progress import Progress, Report

T = TypeVar("T")

#: About what a round takes when nothing is known of earlier ones [s]: those of the shipped beam took 35 to 150.
EXPECTED = 90.0
#: What a round is called, by the first of these steps that is not kept: each has an expected time of its own.
CALLED = {
    "arrangement": "diagnosis",
    "scores": "diagnosis, from the screening on",
    "places": "diagnosis, from the fits on",
}
KEPT = "diagnosis, from what is kept"


class Phases:
    """Shows the phases of a round.

    Parameters
    ----------
    progress
        Where to.
    whole
        Report of the round as a whole.
    """

    def __init__(self, progress: Progress, whole: Report) -> None:
        self._progress, self._whole = progress, whole
        self._inner = ExitStack()
        self._name, self._share = "", 0.0
        self._made = self._found = False
        # Shares of the round that were made, and that were kept.
        self._done = self._kept = 0.0

    def report(self, name: str, share: float) -> None:
        """A phase, or more of it, at so large a share of the round."""
        if self._made:
            self._done += share - self._share
        else:
            self._kept += share - self._share
        self._share = share
        if name != self._name:
            self.close()
            self._name, self._made, self._found = name, False, False
        self._whole(self._done, 1.0 - self._kept)

    def close(self) -> None:
        """End the phase."""
        self._inner.close()
        if self._found and not self._made:
            self._progress.kept(self._name)

    def watched(self, keep: Keep) -> Keep:
        """The same store of steps, looked at."""

        def look(name: str, make: Callable[[], T]) -> T:
            def making() -> T:
                if not self._made:
                    self._made = True
                    self._inner.enter_context(self._progress.step(self._name))
                return make()

            found = keep(name, making)
            self._found = True
            return found

        return look


@contextmanager
def phases(progress: Progress, holds: Callable[[str], bool], number: int = 1) -> Iterator[Phases]:
    """The round as one step with its time left, its phases as steps within.

    Parameters
    ----------
    progress
        Where to.
    holds
        Whether a step of the round is kept.
    number
        Of the round: what took minutes before the first effect was added takes much less after it.
    """
    called = next((called for step, called in CALLED.items() if not holds(step)), KEPT)
    expected = EXPECTED if called == CALLED["arrangement"] else None
    with progress.step(called if number == 1 else f"{called}, round {number}", expected=expected) as whole:
        shown = Phases(progress, whole)
        try:
            yield shown
        finally:
            shown.close()
