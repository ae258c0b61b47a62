"""A step of a command that is one stage: shown while it is computed, and as kept where it was found."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

from pipeline.progress import Progress, Report
from pipeline.store import Stage, Store

P = ParamSpec("P")
R = TypeVar("R")


class ShownStep:
    """One step.

    Parameters
    ----------
    name
        Shown.
    store, progress
        Of the command's run.
    expected
        Time that it takes, until a run knows better [s].
    """

    def __init__(self, name: str, store: Store, progress: Progress, expected: float | None = None) -> None:
        self._name = name
        self._store = store
        self._progress = progress
        self._expected = expected
        self._shown: Report | None = None

    def report(self, done: float, total: float) -> None:
        """For a stage that reports how far it is."""
        if self._shown is not None:
            self._shown(done, total)

    def run(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Result of the stage, looked up or computed."""
        outcome = self._store.outcome_within(self._computing, stage, *args, **kwargs)
        if outcome.cached:
            self._progress.kept(self._name)
        return outcome.value

    @contextmanager
    def _computing(self) -> Iterator[None]:
        with self._progress.step(self._name, expected=self._expected) as self._shown:
            yield
