"""Errors of a case file; the whole tree is drawn in `geometry.errors`."""

from collections.abc import Sequence
from dataclasses import dataclass

from geometry.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One problem of a case file.

    Parameters
    ----------
    file
        The file as the user named it.
    line
        Line, counted from 1; 0 if the problem is the file itself.
    key
        Dotted key, such as ``blade.length`` or ``excitation[1].force``; empty if there is none.
    text
        Mistake and remedy.
    """

    file: str
    line: int
    key: str
    text: str

    def __str__(self) -> str:
        """``file:line: key: what is wrong``, as compilers print it."""
        where = f"{self.file}:{self.line}" if self.line else self.file
        return f"{where}: {self.text}"


class CaseError(InputError):
    """A case file that cannot be used; the message has one line for each problem."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda problem: problem.line))
        super().__init__("\n".join(map(str, self.problems)))
