"""``stickslip estimate``: first values of contact parameters and damping from a campaign."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, CampaignFolder, Options, make_command_app

app = make_command_app(
    "estimate",
    """First values of contact stiffness, friction coefficient, preload and damping, from the data that a campaign
    contains: loops, contact forces, resonances of the lowest level, ring-downs, modes (docs/estimate.md). Each
    comes with an interval and its known biases. They are printed with the resulting change of the case; --write
    makes this change. Comments and layout of the file are kept.""",
    examples=["stickslip estimate my.toml campaign", "stickslip estimate my.toml campaign --write"],
)


@app.default
def estimate(
    case: Annotated[Path, Parameter(help="Case file.")],
    campaign: CampaignFolder,
    /,
    *,
    write: Annotated[bool, Parameter(negative="", help="Write the values into the case.")] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Estimate first values of parameters."""
    set_one_thread_by_default()
    from study.estimate.run import run_estimate

    estimated = run_estimate(case, campaign, options.open(place=campaign), write=write)
    return Answer(document=estimated.document(), text=estimated.text())
