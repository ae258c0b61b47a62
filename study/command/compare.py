"""``stickslip compare``: compare a model with measurements, and show where it fails."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, CampaignFolder, Options, Out, make_command_app

app = make_command_app(
    "compare",
    """Reads a case (structure, contact lines, sensors, loads, priors) and a campaign folder, checks the measurements
    for errors, predicts every point, and weights the differences by noise, friction histories and numerical
    error. Writes a CSV of all points, maps of the misfit (level, frequency, sensor, harmonic) and measured and
    predicted responses. With --calibrate the calibration parameters are fitted to the training data first. With
    --limits every repeat and sweep is compared with the limits of all friction histories, of responses and
    contact forces (docs/families.md); each task of that search is stored, so the same command continues after
    Ctrl-C. With --calibrate-families the parameters are also fitted such that the limits enclose all of these
    curves tightly. docs/case.md describes all keys of a case, docs/campaign.md those of a campaign.""",
    examples=["stickslip compare beam.toml campaign --out compared", "stickslip compare beam.toml campaign --limits"],
)


@app.default
def compare(
    case: Annotated[Path, Parameter(help="Case file.")],
    campaign: CampaignFolder,
    /,
    *,
    out: Out = Path("compared"),
    calibrate: Annotated[bool, Parameter(negative="", help="Fit the calibration parameters first.")] = False,
    limits: Annotated[
        bool,
        Parameter(
            negative="", help="Compare every repeat and sweep with the limits of all friction histories; takes minutes."
        ),
    ] = False,
    calibrate_families: Annotated[
        bool,
        Parameter(
            negative="",
            help="Also fit such that the limits tightly enclose the families; implies --calibrate and --limits.",
        ),
    ] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Compare a model with measurements."""
    set_one_thread_by_default()
    from study.compare.data_run import DataComparisonResult
    from study.compare.report import format_report, make_document
    from study.compare.run import run_compare

    compared = run_compare(
        case, campaign, options.open(out, place=campaign), calibrate=calibrate, limits=limits,
        onto_families=calibrate_families,
    )  # fmt: skip
    if isinstance(compared, DataComparisonResult):
        return Answer(document=compared.document(), text=compared.text())
    return Answer(document=make_document(compared), text=format_report(compared))
