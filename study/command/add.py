"""``stickslip add``: write a missing effect into the case."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, make_command_app

app = make_command_app(
    "add",
    """Writes an effect into a case, with the strength that the last `stickslip diagnose` of this case found and the
    calibration parameters that were fitted with it. Comments and layout of the file are kept. Each step is
    recorded in CASE.history.json, and `stickslip undo` reverts it.""",
    examples=['stickslip add "mass at tip"', 'stickslip add mass at tip --case beam.toml --value "93 mg"'],
)

Case = Annotated[Path | None, Parameter(help="Case file; default: the one in this folder.")]


@app.default
def add(
    *effect: Annotated[str, Parameter(help="Name of the effect, as in the diagnosis.")],
    case: Case = None,
    value: Annotated[
        tuple[str, ...],
        Parameter(
            negative="",
            allow_leading_hyphen=True,
            show_default=False,
            help="Value of its parameter, instead of that of the diagnosis: with a unit, except for ratios; repeat "
            "the option for each parameter, in the order of the diagnosis.",
        ),
    ] = (),
    options: Options = DEFAULTS,
) -> Answer:
    """Add an effect."""
    from study.diagnose.add import add as add_effect
    from study.diagnose.add import find_case, read_effect_name
    from study.diagnose.report import describe_step
    from study.diagnose.run import make_step_document

    file = case if case is not None else find_case(Path())
    step = add_effect(file, read_effect_name(effect), value, options.open())
    return Answer(document={"case": str(file), **make_step_document(step)}, text=describe_step(step, file))
