"""``stickslip new``: write a first case file."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, make_command_app

if TYPE_CHECKING:
    from study.new.write import NewCase

app = make_command_app(
    "new",
    """Writes a first case file with explanatory comments. `stickslip solve` can run it unchanged: the structure is
    built once to find its first resonance, and is stored.

    KIND is blade (by its dimensions), rig (the paper's), part (a STEP or mesh FILE), matrices (FILES of mass and
    stiffness, and of the nodes), or plain (one FILE of NumPy or MATLAB, or a reduced model). In a terminal it asks
    for what is not given; otherwise, and with --yes, it uses defaults and marks them by comments. The faces of a
    STEP file are listed and drawn with numbers, the sets of a mesh file are listed; --fix selects what is fixed.""",
    examples=[
        'stickslip new blade --length "250 mm" --out blade.toml',
        "stickslip new part bracket.step --fix 3",
        "stickslip new part wheel.inp --length-unit mm --fix HUB",
        "stickslip new matrices mass.mtx stiffness.mtx dofs.csv --fix 1 --point 31",
        "stickslip new plain chain.npz",
    ],
)

WHY = "blade and rig by dimensions; part of a STEP or mesh file; matrices of another program; plain of NumPy"
Kind = Literal["blade", "rig", "part", "matrices", "plain"]
KINDS: tuple[Kind, ...] = ("blade", "rig", "part", "matrices", "plain")
Text = Annotated[str | None, Parameter(show_default=False)]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Values:
    """Options with values of the case; values that are not given are asked for or assumed."""

    point: Annotated[Text, Parameter(help="Of matrices: the node at which the structure is driven and measured.")] = (
        None
    )
    size: Annotated[
        Text,
        Parameter(
            help='Of a STEP file: size of the elements, such as "3 mm"; default: a size for some thousand elements.'
        ),
    ] = None
    length_unit: Annotated[Text, Parameter(help="Of a mesh file: the unit of its lengths.")] = None
    units: Annotated[Text, Parameter(help='Of matrices: "m, kg, s" or "mm, tonne, s".')] = None
    length: Annotated[Text, Parameter(help='Of a blade: its length, such as "250 mm"; default 200 mm.')] = None
    thickness: Annotated[Text, Parameter(help="Of a blade: its thickness; default 8 mm.")] = None
    chord: Annotated[Text, Parameter(help="Of a blade: its width; default 30 mm.")] = None

    def given(self) -> dict[str, str]:
        """Return the given values, by the name of their option."""
        return {name.replace("_", "-"): value for name, value in vars(self).items() if value is not None}


#: Default of the options: one shared object, since it is immutable.
NOTHING = Values()


@app.default
def new(
    kind: Annotated[Kind | None, Parameter(help="Source of the structure; asked for in a terminal.")] = None,
    files: Annotated[tuple[Path, ...], Parameter(help="Files of the structure.")] = (),
    /,
    *,
    out: Annotated[Path | None, Parameter(help="Case file; default: KIND.toml, or the name of the file.")] = None,
    fix: Annotated[
        tuple[str, ...], Parameter(negative="", help="Fixed face (number), set or node; may be repeated.")
    ] = (),
    values: Values = NOTHING,
    yes: Annotated[bool, Parameter(negative="", help="Do not ask: use defaults.")] = False,
    force: Annotated[bool, Parameter(negative="", help="Replace an existing file.")] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Write a first case."""
    from geometry.errors import InputError
    from study.campaign.question import Assumptions, Question, Terminal
    from study.new.draft import NewCaseRequest
    from study.new.write import write_new_case

    answers = Assumptions() if yes or options.json or not sys.stdin.isatty() else Terminal()
    if kind is None:
        if isinstance(answers, Assumptions):
            raise InputError(f"give the source of the structure: stickslip new {' | '.join(KINDS)}")
        asked = Question(text="What is the source of the structure?", default="blade", why=WHY, choices=KINDS)
        kind = answers.ask(asked).value
    path = out or Path(f"{files[0].stem if files else kind}.toml")
    if path.exists() and not force:
        raise InputError(f"{path} already exists: name another file with --out, or replace it with --force")
    request = NewCaseRequest(path=path, files=files, fix=fix, given=values.given(), answers=answers)
    return _answer(write_new_case(kind, request, options.open()))


def _answer(case: "NewCase") -> Answer:
    files = [case.path, *case.draft.pictures]
    document = {
        "case": str(case.path),
        "frequency_hz": case.frequency,
        "files": [str(file) for file in files],
        "notes": list(case.draft.notes),
    }
    resonance = "" if case.frequency is None else f"\nfirst natural frequency: {case.frequency:.5g} Hz"
    written = ", ".join(map(str, files))
    return Answer(
        document=document,
        text=f"written: {written}{resonance}\nnext: stickslip solve {case.path} --out {case.path.stem}_solved",
    )
