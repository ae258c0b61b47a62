"""``stickslip undo``: what was written into the case last, taken out of it."""

from pathlib import Path

from study.command.add import Case
from study.run_context import DEFAULTS, Answer, Options, make_command_app

app = make_command_app(
    "undo",
    """Takes the effect that `stickslip add` or `stickslip diagnose --auto` added last, or the values of
    `stickslip calibrate` or `estimate --write`, out of the case again, and gives all other numbers the values that they
    had: the file is as it was, byte for byte, but for what you edited elsewhere meanwhile. Where you edited the very
    lines it refuses. Each call takes one step back.""",
    examples=["stickslip undo", "stickslip undo --case beam.toml"],
)


@app.default
def undo(*, case: Case = None, options: Options = DEFAULTS) -> Answer:
    """Take a step back."""
    from study.diagnose.add import CaseEditError, find_case
    from study.diagnose.add import undo as take_back
    from study.diagnose.report import describe_step
    from study.diagnose.run import make_step_document

    del options
    file = case if case is not None else find_case(Path())
    if not file.is_file():
        raise CaseEditError(f"{file}: there is no such case file; check the spelling and the folder")
    step = take_back(file)
    return Answer(document={"case": str(file), **make_step_document(step)}, text=describe_step(step, file))
