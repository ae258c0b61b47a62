"""``stickslip diagnose``: name the physical effect that a model lacks."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, CampaignFolder, Options, Out, Scheduler, Without, make_command_app

app = make_command_app(
    "diagnose",
    """Names the physical effect that a model lacks, with its strength, from a measurement campaign; or reports that
    these tests cannot separate two effects, that nothing is missing (with the detection threshold of each
    effect), or that something is missing that is not one of the known effects, and where. Every effect is tried
    at every place together with the calibration parameters; the error on held-out data decides. Writes an HTML
    page, figures and JSON, and records the result next to the case (CASE.history.json), from where `stickslip
    add` takes the strength. It takes minutes; an interrupted run continues. With --auto the missing effect is
    added to the case, and the case is diagnosed again; `stickslip undo` removes it. See docs/diagnose.md.""",
    examples=[
        "stickslip diagnose beam.toml campaign --out diagnosed",
        "stickslip diagnose beam.toml campaign --auto",
        "stickslip diagnose beam.toml campaign --without cubic gap",
    ],
)


@app.default
def diagnose(
    case: Annotated[Path, Parameter(help="Case file.")],
    campaign: CampaignFolder,
    /,
    *,
    out: Out = Path("diagnosed"),
    auto: Annotated[
        bool, Parameter(negative="", help="Add the missing effect, and diagnose again, at most 5 times.")
    ] = False,
    without: Without = (),
    trials: Annotated[
        int,
        Parameter(
            help="Number of simulated campaigns to check the detection thresholds of a new test layout, such as 40; "
            "each takes as long as a diagnosis. 0: linear theory, with a margin."
        ),
    ] = 0,
    scheduler: Scheduler = None,
    options: Options = DEFAULTS,
) -> Answer:
    """Diagnose a case."""
    set_one_thread_by_default()
    from geometry.errors import InputError
    from study.diagnose.run import format_full_report, make_full_document, run_diagnose

    if trials < 0 or trials == 1:
        raise InputError(f"--trials {trials} is too few: give 0 for linear theory, or at least 2, such as 40")
    diagnosed = run_diagnose(
        case,
        campaign,
        options.open(out, place=campaign, scheduler=scheduler),
        without=without,
        auto=auto,
        trials=trials,
    )
    return Answer(document=make_full_document(diagnosed), text=format_full_report(diagnosed))
