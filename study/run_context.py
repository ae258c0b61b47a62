"""Context, options and answer of a command.

A new command is one file under `study/command` and one line in `study.cli.COMMANDS`::

    app = make_command_app("reduce", "Fixes the boundary ...", examples=["stickslip reduce my.toml --out reduced"])

    @app.default
    def reduce(case: Path, *, out: Out = Path("reduced"), options: Options = DEFAULTS) -> Answer:
        from study.kind.blade.reduce import run_reduce     # heavy imports inside, so that help is quick

        run = options.open(out)                            # refuses an unwritable folder before the computation
        step = run.step("modes", expected=20)
        model = step.run(reduced_model, load_case(case, ReduceCase), report=step.report)
        return Answer(document={"n_dof": model.n}, text=f"{model.n} degrees of freedom")

Commands print nothing themselves: `Answer` is printed as text, or as one JSON document with
``--json``. They raise `InputError` for mistakes that the user can correct and `ComputationFailed` for computations that
did not converge; `study.cli` turns these into exit codes.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Parameter, Token

if TYPE_CHECKING:
    from rich.console import RenderableType

    from pipeline.progress import Progress, ShownStep
    from pipeline.store import Store

Out = Annotated[Path, Parameter(help="Output folder; created if needed.")]
#: Name of the manifest; `correlation.campaign.manifest` would take long to import.
MANIFEST = "campaign.toml"


def _take_folder(_kind: Any, tokens: Sequence[Token]) -> Path:
    """Return the folder of a campaign, given the folder or its manifest."""
    path = Path(tokens[0].value)
    return path.parent if path.name == MANIFEST and path.is_file() else path


CampaignFolder = Annotated[Path, Parameter(help=f"Folder with {MANIFEST}, or that file.", converter=_take_folder)]
Without = Annotated[
    tuple[str, ...],
    Parameter(
        negative="", consume_multiple=True, show_default=False, help="Kinds of effects to leave out, such as cubic."
    ),
]
Scheduler = Annotated[
    str | None,
    Parameter(help="Address of a dask scheduler whose workers do the computation, such as tcp://node1:8786."),
]


@dataclass(frozen=True, kw_only=True)
class Answer:
    """Result of a command.

    Parameters
    ----------
    document
        Result for ``--json``: only text, numbers, lists and dicts; a number that is not finite becomes null.
    text
        Result for people: text, or anything that rich can print for a command that makes no page.
    exit_code
        0, or 1 if the command was completed and the result is bad.
    """

    document: Mapping[str, Any]
    text: "RenderableType"
    exit_code: int = 0


@dataclass(frozen=True, kw_only=True)
class RunContext:
    """Store, progress and output folder of a command's run.

    Parameters
    ----------
    output
        Output folder, checked to be writable; None for a command that writes no files.
    store
        Stored results of stages.
    progress
        Display of the steps, or none.
    json, quiet
        Options of the user.
    pictures
        Whether `stickslip modes` draws pictures.
    scheduler
        Address of the dask scheduler whose workers do the tasks; by default they run on this machine.
    """

    output: Path | None
    store: "Store"
    progress: "Progress"
    json: bool
    quiet: bool
    pictures: bool = True
    scheduler: str | None = None

    def step(self, name: str, *, expected: float | None = None) -> "ShownStep":
        """Make a step of one stage; for `expected` see `pipeline.progress.Progress`."""
        from pipeline.progress import ShownStep

        return ShownStep(name, self.store, self.progress, expected)

    def draw(self, results: Mapping[str, object]) -> list[Path]:
        """Draw and write all registered figures of some results, those of the user's Python files included."""
        from figure.registry import pictures
        from study.run_record import note_pictures

        files = self.write_files({f"{name}.png": picture for name, picture in pictures(results).items()})
        note_pictures(files)
        return list(files)

    def write_files(self, contents: Mapping[str, str | bytes]) -> tuple[Path, ...]:
        """Write contents, by file name, into the output folder."""
        from pipeline.output import replace_file

        assert self.output is not None
        files = {self.output / name: content for name, content in contents.items()}
        for file, content in files.items():
            replace_file(file, content)
        return tuple(files)

    def note(self, sentence: str) -> None:
        """Write a note to standard error, unless the user asked for --quiet or --json."""
        if not (self.quiet or self.json):
            sys.stderr.write(f"stickslip: {sentence}\n")

    @staticmethod
    def warn(sentence: str) -> None:
        """Write a warning to standard error."""
        sys.stderr.write(f"stickslip: warning: {sentence}\n")


def silent_run() -> RunContext:
    """Make a run that stores, shows and writes nothing."""
    from pipeline.progress import SilentProgress
    from pipeline.store import Store

    return RunContext(output=None, store=Store(None), progress=SilentProgress(), json=False, quiet=True)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of every command."""

    json: Annotated[bool, Parameter(negative="", help="Print one JSON document, and no progress.")] = False
    quiet: Annotated[bool, Parameter(negative="", help="Show no progress.")] = False
    cache: Annotated[
        Path | None,
        Parameter(help="Folder of stored results, instead of STICKSLIP_CACHE or the cache folder of the user."),
    ] = None

    figures: Annotated[
        tuple[Path, ...],
        Parameter(
            negative="", help="Python file with your own figures, drawn in addition to the others; may be repeated."
        ),
    ] = ()

    trust: Annotated[
        bool,
        Parameter(negative="", help="Run the Python files named in the case, although they belong to another user."),
    ] = False

    def open(
        self, output: Path | None = None, *, place: Path | None = None, scheduler: str | None = None
    ) -> RunContext:
        """Start a run.

        Parameters
        ----------
        output
            Folder to write into, if the command writes files.
        place
            Campaign folder or case of the run: durations of steps are stored separately for each.
        scheduler
            Address of a dask scheduler that takes tasks, if the user gave one.

        Raises
        ------
        OutputError
            The folder cannot be written.
        """
        from pipeline.duration import Durations
        from pipeline.output import prepare_output
        from pipeline.progress import BarProgress, LineProgress, Progress, SilentProgress
        from pipeline.store import Store
        from study.case.trust import trust_code
        from study.run_record import note_output

        if self.trust:
            trust_code()
        prepared = None if output is None else prepare_output(output)
        if self.figures:
            from figure.registry import REGISTRY

            for file in self.figures:
                REGISTRY.load(file)
        store = Store(self.cache_folder, RunContext.warn)
        if prepared is not None:
            note_output(prepared, store.folder)
        about = ":".join(str(path.resolve()) for path in (prepared, place) if path is not None)
        durations = Durations(store.folder / "durations.npz" if store.folder else None, RunContext.warn, about)
        progress: Progress
        if self.quiet or self.json:
            progress = SilentProgress()
        elif sys.stderr.isatty():
            progress = BarProgress(durations)
        else:
            progress = LineProgress(durations=durations)
        return RunContext(
            output=prepared, store=store, progress=progress, json=self.json, quiet=self.quiet, scheduler=scheduler
        )

    @property
    def cache_folder(self) -> Path:
        """Folder of stored results."""
        from pipeline.cache_folder import default_folder

        return self.cache if self.cache is not None else default_folder()


# Default options of all commands: one shared object, since it is immutable.
DEFAULTS = Options()


def make_command_app(name: str, details: str, *, examples: Sequence[str]) -> App:
    """Make the app of one command.

    Parameters
    ----------
    name
        Name of the command.
    details
        Text in the help of the command, below its line from `study.cli.COMMANDS` and the options.
    examples
        Command lines that work without changes.
    """
    return App(
        name=name,
        help_epilogue=format_details(details, examples=examples),
        default_parameter=Parameter(show_default=_format_default),
    )


def format_details(details: str, *, examples: Sequence[str]) -> str:
    """Format the text below the options in the help of a command, or of a subcommand; see `make_command_app`."""
    shown = "\n".join(f"    {example}" for example in examples)
    return f"{cleandoc(details)}\n\nExamples:\n\n{shown}"


def _format_default(value: object) -> str | None:
    """Format the default of an option for the help; None for a flag and for an option without a default."""
    if value is None or value is False or value == ():
        return None
    return " ".join(map(str, value)) if isinstance(value, tuple) else str(value)
