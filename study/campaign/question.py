"""What files cannot say: asked of the user, or assumed and marked."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True, kw_only=True)
class Question:
    """One thing that the files do not say.

    Parameters
    ----------
    text
        Question, a sentence.
    default
        Most likely answer.
    why
        Why it matters, and why the default is likely.
    choices
        Possible answers; empty for free text.
    """

    text: str
    default: str
    why: str
    choices: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class Marked:
    """A value of the manifest, and why it was assumed; empty where the files or the user say it."""

    value: Any
    assumed: str = ""


class Answers(Protocol):
    """Where answers come from."""

    def ask(self, question: Question) -> Marked:
        """Answer of one question."""


class Assumptions:
    """Every default, marked."""

    def ask(self, question: Question) -> Marked:
        """The default with its reason."""
        return Marked(value=question.default, assumed=question.why)


class Terminal:
    """Answers of a person at the terminal; an empty line takes the default."""

    def __init__(self) -> None:
        self._given: dict[str, Marked] = {}

    def ask(self, question: Question) -> Marked:
        """Print the question and its reason, and read the answer; the same question is asked once."""
        if question.text not in self._given:
            self._given[question.text] = self._read(question)
        return self._given[question.text]

    def _read(self, question: Question) -> Marked:
        listed = f" ({' / '.join(question.choices)})" if question.choices else ""
        sys.stderr.write(f"\n{question.text}{listed}\n  {question.why}\n")
        while True:
            sys.stderr.write(f"  [{question.default}]: ")
            sys.stderr.flush()
            line = sys.stdin.readline()
            answer = line.strip()
            if not answer:  # also at the end of the input
                return Marked(value=question.default, assumed="" if line else question.why)
            if not question.choices or answer in question.choices:
                return Marked(value=answer)
            close = [choice for choice in question.choices if choice.startswith(answer)]
            if len(close) == 1:
                return Marked(value=close[0])
            sys.stderr.write(f'  "{answer}" is not one of {", ".join(question.choices)}\n')
