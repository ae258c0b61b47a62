"""Output of a command: results on standard output, everything else on standard error."""

import importlib.metadata
import json
import os
import shlex
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

from study.json_value import to_json

if TYPE_CHECKING:
    from rich.console import RenderableType

    from casefile.errors import Problem
    from study.run_context import Answer


#: Width of a report [columns], for sentences and tables.
WIDTH = 118
#: Message if memory is exhausted.
OUT_OF_MEMORY = "out of memory; use fewer elements, or a machine with more memory"


class Output:
    """Prints a command's answer, as text or as one JSON document.

    Parameters
    ----------
    stream
        The real standard output.
    as_json
        Whether the user asked for JSON.
    """

    def __init__(self, stream: TextIO, *, as_json: bool) -> None:
        self._stream = stream
        self._as_json = as_json

    def answer(self, answer: "Answer") -> int:
        """Print the answer of a command, and return its exit code."""
        try:
            if self._as_json:
                self._document(answer.document)
            elif isinstance(answer.text, str):
                # Written unchanged: rich would read brackets as markup and fold long lines.
                self._stream.write(f"{answer.text}\n")
            else:
                _print_rich(answer.text, self._stream)
            self._stream.flush()
        except BrokenPipeError:
            raise
        except OSError as error:  # for example a full disk; discarded, or Python would write again at exit
            self.discard_output(answer.exit_code)
            error.filename = "standard output"
            raise
        return answer.exit_code

    def error(self, exit_code: int, kind: str, message: str, problems: "Sequence[Problem]" = ()) -> int:
        """Print an error, and return the exit code."""
        # Problems of a case file have no prefix: editors can follow file:line: text.
        sys.stderr.write(f"{message}\n" if problems else f"stickslip: {message}\n")
        if self._as_json:
            details: dict[str, Any] = {"kind": kind, "exit_code": int(exit_code), "message": message}
            if problems:
                details["problems"] = [
                    {"file": problem.file, "line": problem.line, "key": problem.key, "message": problem.text}
                    for problem in problems
                ]
            self._document({"error": details})
        return exit_code

    def discard_output(self, exit_code: int) -> int:
        """Discard further output, because the reader of standard output has closed it."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)
        return exit_code

    def _document(self, document: Mapping[str, Any]) -> None:
        self._stream.write(json.dumps(to_json(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n")
        self._stream.flush()


@contextmanager
def standard_output(*, as_json: bool) -> Iterator[Output]:
    """Reserve standard output for results; with JSON all other output, of compiled code too, goes to standard error."""
    sys.stdout.flush()
    if not as_json:
        yield Output(sys.stdout, as_json=False)
        return
    copy = os.dup(1)
    os.dup2(2, 1)
    stream = os.fdopen(copy, "w", encoding="utf-8")
    try:
        yield Output(stream, as_json=True)
    finally:
        sys.stdout.flush()
        os.dup2(stream.fileno(), 1)
        stream.close()


@contextmanager
def plain_warnings() -> Iterator[None]:
    """Show each warning about an input once, as a sentence, and other warnings as Python does."""
    shown: set[str] = set()
    with warnings.catch_warnings():
        as_python_does = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            from geometry.errors import InputWarning

            if not issubclass(category, InputWarning):
                as_python_does(message, category, filename, lineno, file, line)
            elif str(message) not in shown:
                shown.add(str(message))
                sys.stderr.write(f"stickslip: warning: {message}\n")

        warnings.showwarning = show
        yield


def report_mistake(error: BaseException, words: Sequence[str]) -> str:
    """Return a sentence about an internal error of stickslip, and write the traceback into a file."""
    file = write_traceback(error, words)
    kind = f"{type(error).__name__}: {error}".strip(": ")
    return f"internal error of stickslip ({kind}); please report it with the file {file}"


def write_traceback(error: BaseException, words: Sequence[str]) -> str:
    """Write versions, command and traceback into a new file and return its name; to standard error if that fails."""
    lines = [
        f"stickslip {importlib.metadata.version('stickslip')}, Python {sys.version}\n",
        f"$ stickslip {shlex.join(words)}\n\n",
        *traceback.format_exception(error),
    ]
    try:
        handle, name = tempfile.mkstemp(prefix="stickslip-error-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.writelines(lines)
    except OSError:
        sys.stderr.writelines(lines)
        return "above: the lines on standard error"
    return name


def _print_rich(text: "RenderableType", stream: TextIO) -> None:
    from rich.console import Console

    class PipeSafeConsole(Console):
        def on_broken_pipe(self) -> None:
            # Rich would end the process with exit code 1, but a closed pipe is not an error.
            raise BrokenPipeError

    PipeSafeConsole(file=stream).print(text)
