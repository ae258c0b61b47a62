"""``stickslip calibrate``: fit the calibration parameters, and write them into the case."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, CampaignFolder, Options, make_command_app

app = make_command_app(
    "calibrate",
    """Fits the calibration parameters of a case, and the effects that were added to it, to the training data of a
    campaign, and writes their values into the case. Comments and layout of the file are kept. The step is
    recorded in CASE.history.json, and `stickslip undo` reverts it.""",
    examples=["stickslip calibrate beam.toml campaign"],
)


@app.default
def calibrate(
    case: Annotated[Path, Parameter(help="Case file.")],
    campaign: CampaignFolder,
    /,
    *,
    without: Annotated[
        tuple[str, ...],
        Parameter(
            negative="",
            consume_multiple=True,
            show_default=False,
            help=(
                "Kinds of effects omitted by the last `diagnose --without`: its stored fit is used, with the same "
                "values."
            ),
        ),
    ] = (),
    options: Options = DEFAULTS,
) -> Answer:
    """Calibrate a case."""
    set_one_thread_by_default()
    from study.diagnose.calibrate import calibrate_case
    from study.diagnose.report import describe_step
    from study.diagnose.run import make_step_document

    step = calibrate_case(case, campaign, options.open(place=campaign), without)
    return Answer(document={"case": str(case), **make_step_document(step)}, text=describe_step(step, case))
