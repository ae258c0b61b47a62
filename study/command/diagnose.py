"""``stickslip diagnose``: which physical effect a model lacks."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, command_app

app = command_app(
    "diagnose",
    """Names the physical effect that a model lacks, with its strength, from a measurement campaign; or says that two
    cannot be told apart, that nothing is missing (and how much of each effect these tests would have shown), or that
    something is missing which is none of the known effects, and where. Every effect is
    tried at every place together with the accepted parameters; what counts is the error on data that
    were held out. Writes a page to look at in a browser, figures and diagnosis.json, and notes the result beside the
    case (CASE.history.json), from where `stickslip add` takes the strength. A run that was interrupted goes on.
    With --auto what is missing is added to the case, and the rest asked again; `stickslip undo` takes it back.
    More stands in docs/diagnose.md.""",
    examples=[
        "stickslip diagnose beam.toml campaign --out diagnosed",
        "stickslip diagnose beam.toml campaign --auto",
        "stickslip diagnose beam.toml campaign --without cubic gap",
    ],
)


@app.default
def diagnose(
    case: Annotated[Path, Parameter(help="Case file.")],
    campaign: Annotated[Path, Parameter(help="Folder with campaign.toml.")],
    /,
    *,
    out: Out = Path("diagnosed"),
    auto: Annotated[bool, Parameter(negative="", help="Add what is missing, and ask again, until nothing is.")] = False,
    without: Annotated[
        tuple[str, ...],
        Parameter(
            negative="", consume_multiple=True, show_default=False, help="Kinds of effects to leave out, such as cubic."
        ),
    ] = (),
    trials: Annotated[
        int,
        Parameter(help="Campaigns without effects that tell, once a layout, what chance does; 0: the linear theory."),
    ] = 40,
    options: Options = DEFAULTS,
) -> Answer:
    """Say what is missing."""
    one_thread_by_default()
    from study.diagnose.add import LoopError
    from study.diagnose.run import full_document, full_text, run_diagnose

    if trials < 0 or trials == 1:
        raise LoopError(f"--trials {trials} tells nothing: give 0 for the linear theory, or at least 2, such as 40")
    diagnosed = run_diagnose(case, campaign, options.open(out), without=without, auto=auto, trials=trials)
    return Answer(document=full_document(diagnosed), text=full_text(diagnosed))
