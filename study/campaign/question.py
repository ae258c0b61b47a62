"""Questions that the files leave open: asked of the user, or answered by a marked assumption."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True, kw_only=True)
class Question:
    """Question that the files leave open.

    Parameters
    ----------
    text
        Question, a sentence.
    default
        Most likely answer.
    why
        Reason for the question or for the default.
    choices
        Possible answers; empty for free text.
    """

    text: str
    default: str
    why: str
    choices: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class Marked:
    """Value of the manifest, and the reason why it was assumed; empty if the files or the user state it."""

    value: Any
    assumed: str = ""


class Answers(Protocol):
    """Source of answers."""

    def ask(self, question: Question) -> Marked:
        """Answer to one question."""


class Assumptions:
    """Source that answers each question by its default, marked as assumed."""

    def ask(self, question: Question) -> Marked:
        """Default with its reason."""
        return Marked(value=question.default, assumed=question.why)


class Terminal:
    """Answers typed at the terminal; an empty line selects the default."""

    def __init__(self) -> None:
        self._given: dict[str, Marked] = {}

    def ask(self, question: Question) -> Marked:
        """Print the question and its reason, and read the answer; a repeated question gets the same answer."""
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
