"""``stickslip estimate``: first values of contact and damping parameters from measurements."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, command_app

app = command_app(
    "estimate",
    """First estimates of contact and damping parameters, straight from a campaign: the tangential stiffness from the
    stick branch of loops or from the stuck resonance, the friction coefficient from the largest |T/N|, the preload from
    static forces, the damping from the lowest level. Each comes with its interval and its known bias. With --write they
    become factors under [calibrated] of the case. See docs/estimate.md.""",
    examples=["stickslip estimate beam.toml campaign", "stickslip estimate beam.toml campaign --write"],
)


@app.default
def estimate(
    case: Annotated[Path, Parameter(help="Case file.")],
    campaign: Annotated[Path, Parameter(help="Folder with campaign.toml.")],
    /,
    *,
    write: Annotated[bool, Parameter(negative="", help="Write the factors into the case.")] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Estimate parameters."""
    one_thread_by_default()
    from study.estimate.run import run_estimate

    estimated = run_estimate(case, campaign, options.open(), write=write)
    return Answer(document=estimated.document(), text=estimated.text())
