"""``stickslip undo``: remove the last change from the case."""

from pathlib import Path

from study.command.add import Case
from study.run_context import DEFAULTS, Answer, Options, make_command_app

app = make_command_app(
    "undo",
    """Removes the effect that `stickslip add` or `stickslip diagnose --auto` added last, or the values of `stickslip
    calibrate` or `estimate --write`, from the case, and restores all other numbers: the file is restored byte for
    byte, except for your edits elsewhere in it. If you have edited the same lines, it refuses. Each call reverts
    one step.""",
    examples=["stickslip undo", "stickslip undo --case beam.toml"],
)


@app.default
def undo(*, case: Case = None, options: Options = DEFAULTS) -> Answer:
    """Undo a step."""
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
