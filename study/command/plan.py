"""``stickslip plan``: which effects planned tests would show."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, Without, make_command_app

app = make_command_app(
    "plan",
    """Before any test: which effects of the catalogue the planned tests would show, how strong each must be to be
    named, and which of them look alike. Sensors, levels and band are those of the case unless options say otherwise.
    Every effect is compared with the noise, with what differs between repeats, with friction histories and with the
    numerical and model error of the case; what the calibration parameters can make up for does not count. Writes a
    figure and JSON. See docs/plan.md.""",
    examples=[
        "stickslip plan beam.toml --out planned",
        "stickslip plan beam.toml --sensors tip mid --levels 1 3 10 --repeats 5 --free",
        'stickslip plan beam.toml --from "430 Hz" --to "500 Hz" --frequencies 16 --noise "1 %" --sweep up',
    ],
)
Text = Annotated[str | None, Parameter(show_default=False)]


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class Tests:
    """Options of the planned tests."""

    __test__ = False  # no test of pytest's

    sensors: Annotated[
        tuple[str, ...],
        Parameter(
            negative="",
            consume_multiple=True,
            show_default=False,
            help="Sensors or places of the case; all sensors by default.",
        ),
    ] = ()
    levels: Annotated[
        tuple[float, ...],
        Parameter(
            negative="",
            consume_multiple=True,
            show_default=False,
            help="Levels, as factors on the load of the case (N if that is 1 N); those of [sweep] by default, else 1.",
        ),
    ] = ()
    first: Annotated[
        Text, Parameter(name="--from", help='Begin of the band, such as "430 Hz"; that of [sweep] by default.')
    ] = None
    last: Annotated[Text, Parameter(name="--to", help="End of the band; that of [sweep] by default.")] = None
    frequencies: Annotated[int, Parameter(help="Frequencies of a curve.")] = 24
    repeats: Annotated[int, Parameter(help="Repeats.")] = 3
    sweep: Annotated[Literal["up", "down", "both"], Parameter(help="Directions of the sweeps.")] = "both"
    harmonics: Annotated[
        tuple[int, ...], Parameter(negative="", consume_multiple=True, help="Harmonics of the motions.")
    ] = (1,)
    noise: Annotated[str, Parameter(help="Noise of the real and of the imaginary part of a reading, relative.")] = (
        "0.5 %"
    )
    free: Annotated[bool, Parameter(negative="", help="Test the structure without its contacts as well.")] = False


#: One object, since it cannot be changed.
USUAL = Tests()


@app.default
def plan(
    case: Annotated[Path, Parameter(help="Case file.")],
    /,
    *,
    out: Out = Path("planned"),
    tests: Tests = USUAL,
    without: Without = (),
    options: Options = DEFAULTS,
) -> Answer:
    """Plan tests."""
    set_one_thread_by_default()
    from study.plan.planned_tests import PlanRequest
    from study.plan.run import run_plan

    request = PlanRequest(
        levels=tests.levels, first=tests.first, last=tests.last, n_frequency=tests.frequencies, n_repeat=tests.repeats,
        sweep=tests.sweep, harmonics=tests.harmonics, noise=tests.noise, sensors=tests.sensors, free=tests.free,
    )  # fmt: skip
    planned = run_plan(case, request, options.open(out), without=without)
    return Answer(document=planned.document(), text=planned.text())
