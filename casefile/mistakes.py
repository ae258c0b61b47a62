"""Mistakes of a case that only show when a model is made of it, collected: the user sees all of them at once."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from casefile.errors import CaseError, Problem
from casefile.table import CaseModel, located


@dataclass
class Mistakes:
    """What is wrong with a case so far.

    Parameters
    ----------
    case
        As `casefile.table.load_case` returned it.
    problems
        Found ones.
    """

    case: CaseModel
    problems: list[Problem] = field(default_factory=list)

    @contextmanager
    def at(self, *table: str | int) -> Iterator[None]:
        """Note what goes wrong within, with file and line, and go on behind it."""
        try:
            with located(self.case, *table):
                yield
        except CaseError as error:
            self.problems += error.problems

    def raise_if_any(self) -> None:
        """Raise a `CaseError` with all of them."""
        if self.problems:
            raise CaseError(list(dict.fromkeys(self.problems)))
