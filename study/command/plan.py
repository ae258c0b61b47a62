"""``stickslip plan``: list the effects that planned tests would detect."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, Options, Out, Without, make_command_app

app = make_command_app(
    "plan",
    """Before any test: which effects of the catalogue the planned tests would show, how strong each must be to be
    identified, and which of them cannot be separated. Sensors, levels and band are those of the case unless
    options say otherwise. Every effect is compared with the noise, the scatter between repeats, friction
    histories and the numerical and model error of the case; what the calibration parameters can compensate does
    not count. Writes a figure and JSON. See docs/plan.md.""",
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

    __test__ = False  # not a class of tests for pytest

    sensors: Annotated[
        tuple[str, ...],
        Parameter(
            negative="",
            consume_multiple=True,
            show_default=False,
            help="Sensors or places of the case; default: all sensors.",
        ),
    ] = ()
    levels: Annotated[
        tuple[float, ...],
        Parameter(
            negative="",
            consume_multiple=True,
            show_default=False,
            help="Levels, as factors on the load of the case (N if that is 1 N); default: those of [sweep], else 1.",
        ),
    ] = ()
    first: Annotated[
        Text, Parameter(name="--from", help='Lower end of the band, such as "430 Hz"; default: that of [sweep].')
    ] = None
    last: Annotated[Text, Parameter(name="--to", help="Upper end of the band; default: that of [sweep].")] = None
    frequencies: Annotated[int, Parameter(help="Number of frequencies of a curve.")] = 24
    repeats: Annotated[int, Parameter(help="Repeats.")] = 3
    sweep: Annotated[Literal["up", "down", "both"], Parameter(help="Directions of the sweeps.")] = "both"
    harmonics: Annotated[
        tuple[int, ...], Parameter(negative="", consume_multiple=True, help="Harmonics of the motions.")
    ] = (1,)
    noise: Annotated[str, Parameter(help="Relative noise of the real and of the imaginary part of a reading.")] = (
        "0.5 %"
    )
    free: Annotated[bool, Parameter(negative="", help="Also test the structure without its contacts.")] = False


#: Default of the options: one shared object, since it is immutable.
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
