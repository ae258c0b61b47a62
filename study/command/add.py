"""``stickslip add``: an effect that is missing, written into the case."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, make_command_app

app = make_command_app(
    "add",
    """Writes an effect into a case, with the strength that the last `stickslip diagnose` of this case found and
    the calibration parameters calibrated beside it. Comments and layout of the file stay. Each step is noted in
    CASE.history.json, and `stickslip undo` takes it back.""",
    examples=['stickslip add "mass at tip"', 'stickslip add mass at tip --case beam.toml --value "93 mg"'],
)

Case = Annotated[Path | None, Parameter(help="Case file; the one of this folder by default.")]


@app.default
def add(
    *effect: Annotated[str, Parameter(help="Its name, as the diagnosis writes it.")],
    case: Case = None,
    value: Annotated[
        tuple[str, ...],
        Parameter(
            negative="",
            allow_leading_hyphen=True,
            show_default=False,
            help="Value of its parameter, instead of that of the diagnosis: with a unit, for ratios none; repeated for "
            "each parameter, in the order of the diagnosis.",
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
