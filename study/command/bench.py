"""``stickslip bench``: case and measurements in the browser."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from pipeline.blas_threads import set_one_thread_by_default
from study.run_context import DEFAULTS, Answer, CampaignFolder, Options, Without, make_command_app

app = make_command_app(
    "bench",
    """Opens a case and a measurement campaign in the browser: measured families over predictions with residuals, the
    readings at which the model fails, effects that may be missing, and the parameters as sliders. Add, Undo and
    Calibrate write the case as `stickslip add`, `undo` and `calibrate` do. All actions can be exported as a
    script that gives the same numbers. The server accepts connections only from this computer, with the token in
    its address; the page loads nothing from elsewhere. Ctrl-C ends it, and nothing is lost. See docs/bench.md.""",
    examples=["stickslip bench beam.toml campaign", "stickslip bench beam.toml campaign --port 8350 --no-browser"],
)


@app.default
def bench(
    case: Annotated[Path, Parameter(help="Case file.")],
    campaign: CampaignFolder,
    /,
    *,
    port: Annotated[int, Parameter(help="Port on this computer; 0 selects a free one.")] = 0,
    browser: Annotated[bool, Parameter(help="Open the browser.")] = True,
    without: Without = (),
    options: Options = DEFAULTS,
) -> Answer:
    """Open the bench."""
    set_one_thread_by_default()
    from study.bench.server import serve_bench
    from study.bench.work import BenchFiles
    from study.kind.registry import open_case

    open_case(case)  # reports mistakes of the file before the server starts
    addresses: list[str] = []

    def opened(address: str) -> None:
        addresses.append(address)
        # The address is always printed, also with --quiet and --json: the page cannot be opened without it.
        sys.stderr.write(f"stickslip: the bench is at {address} (Ctrl-C ends it)\n")
        sys.stderr.flush()
        if browser:
            import webbrowser

            webbrowser.open(address)

    place = BenchFiles(case=case, folder=campaign, without=without, cache=options.cache_folder, trust=options.trust)
    serve_bench(place, port, opened=opened)
    return Answer(document={"case": str(case), "address": addresses[0]}, text="The bench is closed; nothing is lost.")
