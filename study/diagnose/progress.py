"""Progress of a diagnosis: stored steps are marked as stored, and do not count in the time left.

`diagnosis.diagnose` reports phases; within a phase steps are looked up or computed. Its line opens when the first step
is computed, so that a phase with only stored steps shows no duration but that it is stored.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TypeVar

from diagnosis.step import RunStep
from pipeline.progress import Progress, Report

T = TypeVar("T")

#: Expected duration of a round without knowledge of earlier ones [s]: those of the shipped beam took 35 to 150.
EXPECTED = 90.0
#: Title of a round by the first of these steps that is not stored: each title has its own expected time.
TITLES = {
    "arrangement": "diagnosis",
    "scores": "diagnosis, from the screening on",
    "nominal": "diagnosis, from the fits on",
}
ALL_STORED = "diagnosis, from stored results"


class Phases:
    """Shows the phases of a round.

    Parameters
    ----------
    progress
        Shows the phases.
    whole
        Report of the round as a whole.
    """

    def __init__(self, progress: Progress, whole: Report) -> None:
        self._progress, self._whole = progress, whole
        self._inner = ExitStack()
        self._name, self._share = "", 0.0
        self._is_computed = self._is_stored = False
        # Computed and stored shares of the round.
        self._computed = self._stored = 0.0

    def report(self, name: str, share: float) -> None:
        """Report a phase, new or continued, at a share of the round."""
        if self._is_computed:
            self._computed += share - self._share
        else:
            self._stored += share - self._share
        self._share = share
        if name != self._name:
            self.close()
            self._name, self._is_computed, self._is_stored = name, False, False
        self._whole(self._computed, 1.0 - self._stored)

    def close(self) -> None:
        """End the phase."""
        self._inner.close()
        if self._is_stored and not self._is_computed:
            self._progress.stored(self._name)

    def abandon(self, error: BaseException) -> None:
        """End the phase in which an error or the user stopped the round, as unfinished."""
        self._inner.__exit__(type(error), error, error.__traceback__)

    def watched(self, run_step: RunStep) -> RunStep:
        """A store of steps that reports its use as progress."""

        def look_up(name: str, make: Callable[[], T]) -> T:
            def compute() -> T:
                if not self._is_computed:
                    self._is_computed = True
                    self._inner.enter_context(self._progress.step(self._name))
                return make()

            value = run_step(name, compute)
            self._is_stored = True
            return value

        return look_up


@contextmanager
def phases(progress: Progress, is_stored: Callable[[str], bool], number: int = 1) -> Iterator[Phases]:
    """The round as one step with its time left, its phases as steps within.

    Parameters
    ----------
    progress
        Shows the round.
    is_stored
        Whether a step of the round is stored.
    number
        Number of the round: later rounds take much less time than the first one.
    """
    title = next((title for step, title in TITLES.items() if not is_stored(step)), ALL_STORED)
    expected = EXPECTED if title == TITLES["arrangement"] else None
    with progress.step(title if number == 1 else f"{title}, round {number}", expected=expected) as whole:
        shown = Phases(progress, whole)
        try:
            yield shown
        except BaseException as error:
            shown.abandon(error)
            raise
        shown.close()
