"""``stickslip study``: replay the calibration of the reference paper, or apply it to a case and a campaign."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.types import NonNegativeInt

from pipeline.blas_threads import set_one_openblas_thread_by_default
from study.run_context import DEFAULTS, Answer, CampaignFolder, Options, Out, format_details, make_command_app

app = make_command_app(
    "study",
    """`study paper` replays the calibration of Ferhatoglu, Botto and Zucca (2024) on a virtual rig; `study
    calibrate` does the same for a case of a rig and a measured campaign. `stickslip study COMMAND --help` has
    more.""",
    examples=["stickslip study paper --out replayed", "stickslip study calibrate rig.toml campaign --out calibrated"],
)

PAPER = format_details(
    """Replays the calibration of Ferhatoglu, Botto and Zucca (2024) on the shipped rig: a virtual campaign, the first
    guesses of section 4.1, Table 2, and figures 12 and 14 to 23, with the criteria as numbers. Writes paper.html, all
    figures and the campaign. docs/paper.md maps the paper to the program.""",
    examples=["stickslip study paper --out replayed", "stickslip study paper --quick --out tried"],
)
CALIBRATE = format_details(
    """Linear iterations, nonlinear iterations by families over limits, criteria and intervals. Steps without data
    in the campaign are omitted and listed. Writes calibration.html, figures and the calibrated case. See
    docs/paper.md.""",
    examples=["stickslip study calibrate rig.toml campaign --out calibrated"],
)


@app.command(name="paper", help_epilogue=PAPER)
def paper(
    *,
    out: Out = Path("paper"),
    seed: Annotated[NonNegativeInt, Parameter(help="Seed of the specimen, its histories and noise.")] = 1,
    like: Annotated[
        int,
        Parameter(
            help="Iteration of the paper that the specimen corresponds to: 1 symmetric, 2 shifted, 3 also inclined."
        ),
    ] = 3,
    quick: Annotated[
        bool, Parameter(negative="", help="Coarse mesh, few points, two repeats: a trial run of some minutes.")
    ] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Replay the calibration of the reference paper on a virtual rig."""
    set_one_openblas_thread_by_default()
    from geometry.errors import InputError
    from study.paper.report import format_report, make_document, write_report
    from study.paper.truth import LIKE

    if like not in LIKE:
        raise InputError(f"--like {like} is not a kind of specimen: give {', '.join(map(str, LIKE))}")
    report = write_report(options.open(out), seed=seed, like=like, quick=quick)
    return Answer(document=make_document(report), text=format_report(report))


@app.command(name="calibrate", help_epilogue=CALIBRATE)
def calibrate(
    case: Annotated[Path, Parameter(help="Case file of a rig.")],
    campaign: CampaignFolder,
    /,
    *,
    out: Out = Path("calibrated"),
    quick: Annotated[
        bool, Parameter(negative="", help="Few points and few models in each fit: a trial run of some minutes.")
    ] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Calibrate a rig to its campaign in the steps of the reference paper."""
    set_one_openblas_thread_by_default()
    from study.paper.calibration import run_calibration

    result = run_calibration(case, campaign, options.open(out, place=campaign), quick=quick)
    return Answer(document=result.document(), text=result.text())
