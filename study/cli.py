"""The command line: finds and runs the command, and turns its outcome into an exit code and a message.

Exit codes: 0 done; 1 a computation did not converge, or `doctor` found something missing; 2 an input that the user can
correct; 3 interrupted; 70 an internal error of stickslip.

Nothing heavy is imported here: each command is imported when it is called.
"""

import gc
import importlib.metadata
import sys
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING

from cyclopts import App, CycloptsError

from pipeline.output import removed_if_empty
from study import console
from study.interruption import Interruption, end_process
from study.run_record import list_noted_pictures, recorded

if TYPE_CHECKING:
    from study.run_context import Answer


class ExitCode(IntEnum):
    """Exit codes of the program."""

    DONE = 0
    FAILED = 1
    BAD_INPUT = 2
    INTERRUPTED = 3
    INTERNAL = 70


# Name, module and object, and the line in the list of commands.
COMMANDS = (
    ("new", "study.command.new:app", "Write a first case file of a blade, a rig, a part or matrices."),
    (
        "table1",
        "study.command.table1:app",
        "Reproduce the mesh study of the paper: one frequency in three ways, ten models.",
    ),
    ("modes", "study.command.modes:app", "Compute natural frequencies, and draw the mode shapes of a blade or mesh."),
    (
        "reduce",
        "study.command.reduce:app",
        "Reduce a blade, a rig, your own part or matrices by the Craig-Bampton method.",
    ),
    ("solve", "study.command.solve:app", "Compute response curves of a structure with friction and gaps."),
    (
        "limits",
        "study.command.limits:app",
        "Compute the band of responses that an unknown friction history can produce.",
    ),
    ("sweep", "study.command.sweep:app", "Compute response curves and limits over a grid of parameters."),
    ("spread", "study.command.spread:app", "Compute the spread of the response over uncertain parameters."),
    ("campaign", "study.command.campaign:app", "Draft the manifest of a folder of test files (campaign new)."),
    ("estimate", "study.command.estimate:app", "Read first values of contact and damping parameters from tests."),
    ("plan", "study.command.plan:app", "Show which effects planned tests would reveal, and how strong they must be."),
    ("compare", "study.command.compare:app", "Compare a model with measurements, and show where it fails."),
    ("diagnose", "study.command.diagnose:app", "Name the effect that a model lacks, or say that none is missing."),
    ("calibrate", "study.command.calibrate:app", "Fit the calibration parameters of a case, and write them into it."),
    ("add", "study.command.add:app", "Write a missing effect into a case: later commands compute the corrected model."),
    ("undo", "study.command.undo:app", "Remove the effect or the calibration that was written last from a case."),
    ("bench", "study.command.bench:app", "Open case and measurements in the browser: see, add, undo, move parameters."),
    ("study", "study.command.study:app", "Run a whole study: replay the calibration of the reference paper."),
    ("doctor", "study.command.doctor:app", "Show missing requirements, and the one line that installs them."),
    ("runs", "study.command.runs:app", "List, compare and remove the runs of a folder."),
    (
        "repeat",
        "study.command.repeat:app",
        "Run the command that made a page or a result again, and compare the numbers.",
    ),
    ("completion", "study.command.completion:app", "Print a script that completes commands in a shell."),
    ("cache", "study.command.cache:app", "Show how much space the stored results take, or remove them."),
)

#: Thresholds of Python's garbage collector: new objects per collection, and collections of one generation per
#: collection of the next. Imported libraries hold a million objects; with Python's defaults a command spends a tenth of
#: its time on collections.
GARBAGE_THRESHOLDS = (500_000, 20, 50)

HELP = """\
Predict how structures with friction joints vibrate, compare the prediction with measurements, and name the effect \
that the model lacks."""

EPILOGUE = """\
Examples:

    stickslip table1 --out table1
    stickslip modes part.inp --length-unit mm --fix CLAMP
    stickslip solve my.toml --out solved
    stickslip diagnose my.toml campaign --out diagnosed
    stickslip doctor
    stickslip cache --clear
    stickslip COMMAND --help

Exit codes: 0 done, 1 not converged or something missing, 2 bad input, 3 interrupted (finished work is stored), \
70 internal error.
"""


def make_command_line() -> App:
    """Make the app with all commands, without importing any of them."""
    app = App(
        name="stickslip",
        help=HELP,
        help_epilogue=EPILOGUE,
        version=lambda: importlib.metadata.version("stickslip"),
        print_error=False,
        exit_on_error=False,
        suppress_keyboard_interrupt=False,
        result_action="return_value",
    )
    for name, where, summary in COMMANDS:
        app.command(where, name=name, help=summary)
    return app


def run_command(words: Sequence[str]) -> "Answer | None":
    """Run a command and return its answer, with a page of its pictures; None for help and version, already printed."""
    answer: Answer | None = make_command_line()(words)
    if answer is None or not (pictures := list_noted_pictures()):
        return answer
    from study.page.run_page import add_run_page

    return add_run_page(answer, words[0], pictures)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    arguments
        Words after the program's name; those of the process by default.

    Returns
    -------
    The exit code.
    """
    gc.set_threshold(*GARBAGE_THRESHOLDS)
    words = list(sys.argv[1:] if arguments is None else arguments)
    with console.standard_output(as_json="--json" in words) as output:
        code = int(_run_guarded(lambda: run_command(words), words, output))
    if arguments is None:
        if code == ExitCode.INTERRUPTED:
            end_process(code)
        # A collection of garbage at exit takes half a second; the memory is freed anyway.
        gc.freeze()
    return code


def _run_guarded(run: "Callable[[], Answer | None]", words: Sequence[str], output: console.Output) -> int:
    """Run a command, and turn any exception into a message and an exit code."""
    interruption = Interruption()
    try:
        with interruption.watched(), removed_if_empty(), console.plain_warnings(), recorded(words) as answers:
            answer = run()
            if answer is not None:
                answers.append((answer.exit_code, answer.document))
        # Help and version have been printed already and have no answer.
        return ExitCode.DONE if answer is None else output.answer(answer)
    except KeyboardInterrupt:
        return _report_interruption(output)
    except Exception as error:
        # Compiled code, or its import, may replace a KeyboardInterrupt by another error.
        if interruption.has_come or isinstance(error.__cause__ or error.__context__, KeyboardInterrupt):
            return _report_interruption(output)
        return _report_failure(error, words, output)


def _report_interruption(output: console.Output) -> int:
    return output.error(
        ExitCode.INTERRUPTED,
        "interrupted",
        "interrupted; finished work is stored: the same command continues from there",
    )


def _report_failure(error: Exception, words: Sequence[str], output: console.Output) -> int:
    if isinstance(error, CycloptsError):
        return output.error(ExitCode.BAD_INPUT, "usage", f"{error} See `{_format_help_line(words)}`.")
    if isinstance(error, BrokenPipeError):
        return output.discard_output(ExitCode.DONE)  # The reader, such as `head`, has closed the pipe.
    if isinstance(error, MemoryError):
        return output.error(ExitCode.FAILED, "computation", console.OUT_OF_MEMORY)
    # Imported here because the package of InputError may import numpy, which help does not need.
    from casefile.errors import CaseError
    from geometry.errors import ComputationFailed, InputError
    from pipeline.output import describe_system_failure
    from study.merge_sentences import merge_similar

    if isinstance(error, CaseError):
        return output.error(ExitCode.BAD_INPUT, "case", str(error), error.problems)
    if isinstance(error, InputError):
        return output.error(ExitCode.BAD_INPUT, "input", "\n".join(merge_similar(str(error).splitlines())))
    if isinstance(error, ComputationFailed):
        return output.error(ExitCode.FAILED, "computation", str(error))
    if (sentence := describe_system_failure(error)) is not None:
        return output.error(ExitCode.BAD_INPUT, "input", sentence)
    return output.error(ExitCode.INTERNAL, "internal", console.report_mistake(error, words))


def _format_help_line(words: Sequence[str]) -> str:
    known = [name for name, _, _ in COMMANDS if words and words[0] == name]
    return " ".join(["stickslip", *known, "--help"])
