"""A bench as a user starts it, and a browser that notes what a page must not do.

A server and its worker take some ten seconds to start, so the tests of a file share one.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import pytest

from benchmarks.two_masses import TWO_MASSES, write_two_masses
from study.diagnose.history import name_history_file, read_text

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
#: Software drawing, so that the structure is drawn without a graphics card.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
#: Longest wait for a computation on a machine that does much else [s].
PATIENCE = 300.0

#: Where the two masses are: the page draws them.
PLACED = TWO_MASSES.replace(
    "# kg, N/m\n",
    """# kg, N/m

[[structure.dof]]
direction = "z"
coordinates = ["0 mm", "0 mm", "0 mm"]

[[structure.dof]]
node = 1
direction = "z"
coordinates = ["100 mm", "0 mm", "0 mm"]
""",
)
HIDDEN = {"mass at tip": 0.006}
#: Words that leave out the kinds which take the longest to fit, of effects that are not hidden.
WITHOUT = ("--without", "spring", "dashpot", "cubic", "gap", "air damping", "density")

Started = Callable[..., Any]


class RunningBench:
    """A process of ``stickslip bench``, its address, case and campaign."""

    def __init__(self, process: "subprocess.Popen[str]", address: str, case: Path, campaign: Path) -> None:
        self.process, self.address, self.case, self.campaign = process, address, case, campaign

    def end(self, number: int = signal.SIGINT) -> int:
        """End it, and return its exit code."""
        self.process.send_signal(number)
        return self.process.wait(30)


@contextmanager
def running(case: Path, campaign: Path, *words: str) -> Iterator[RunningBench]:
    """A bench with a cache beside the case."""
    command = [sys.executable, "-m", "stickslip", "bench", str(case), str(campaign), "--no-browser"]
    command += ["--cache", str(case.parent / "cache"), *words]
    with NamedTemporaryFile("w", dir=case.parent, suffix=".err", delete=False) as stream:
        process = subprocess.Popen(command, stdout=stream, stderr=stream, text=True, env=os.environ.copy())
    log = Path(stream.name)
    try:
        end = time.monotonic() + 60
        while "http://" not in log.read_text() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        text = log.read_text()
        assert "http://" in text, text
        yield RunningBench(process, "http://" + text.split("http://")[1].split()[0], case, campaign)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(30)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[RunningBench, str]]:
    """The bench of two masses that all tests of a file share, and the text of its case as drawn."""
    case = write_two_masses(tmp_path_factory.mktemp("bench"), HIDDEN, case=PLACED)
    with running(case, case.parent / "campaign", *WITHOUT) as bench:
        yield bench, read_text(case)
        assert bench.process.poll() is not None or bench.end() == 0


@pytest.fixture
def bench(served: tuple[RunningBench, str]) -> RunningBench:
    """The shared bench, whose case is as drawn and has no history."""
    bench, drawn = served
    bench.case.write_text(drawn, encoding="utf-8")
    name_history_file(bench.case).unlink(missing_ok=True)
    return bench


def children(pid: int) -> list[int]:
    """Processes of a process that compute: Python's own helper for shared resources is none."""
    result = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(stat.read_text().rpartition(")")[2].split()[1])
            words = (stat.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if parent == pid and b"spawn_main" in words:
            result.append(int(stat.parent.name))
    return result


def await_end(processes: list[int]) -> None:
    """Wait until processes are gone, which look for their parent each second."""
    end = time.monotonic() + PATIENCE
    while any(Path(f"/proc/{number}").exists() for number in processes):
        assert time.monotonic() < end
        time.sleep(0.1)


def until(page: Any, expression: str, patience: float = PATIENCE) -> None:
    """Wait until an expression of the page is true; its own rules forbid Playwright's way of asking."""
    end = time.monotonic() + patience
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        page.wait_for_timeout(100)


def press(page: Any, selector: str) -> None:
    """Press a button by keyboard."""
    page.focus(selector)
    page.keyboard.press("Enter")


@pytest.fixture(scope="session")
def axe() -> str:
    """Script of axe-core, which finds faults of accessibility."""
    package = pytest.importorskip("axe_playwright_python", reason="pip install axe-playwright-python")
    return (Path(package.__file__).parent / "axe.min.js").read_text(encoding="utf-8")


def find_faults(page: Any, axe: str) -> list[str]:
    """Serious and critical faults of a page as it is now, each with its places."""
    page.evaluate(f"window.axe || (() => {{ {axe} }})()")
    result = page.evaluate("axe.run(document, { resultTypes: ['violations'] })")["violations"]
    return [
        f"{fault['id']}: {[node['target'] for node in fault['nodes']]}"
        for fault in result
        if fault["impact"] in {"serious", "critical"}
    ]


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """Chromium under Playwright."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="pip install playwright")
    assert CHROMIUM, "the browser tests need Chromium: sh install.sh, or apt-get install chromium"
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def open_page(chromium: Any) -> Iterator[Started]:
    """Opens addresses; in the end no page has logged an error, or asked anything of another server."""
    errors: list[str] = []
    contexts = []

    def start(address: str, width: int = 1280, scheme: str = "light", *, expects_errors: bool = False) -> Any:
        # Without a graphics card each picture of a moving structure takes the processor that the bench computes on.
        context = chromium.new_context(
            viewport={"width": width, "height": 900}, color_scheme=scheme, reduced_motion="reduce"
        )
        contexts.append(context)
        page, own = context.new_page(), address.split("/")[2]
        page.set_default_timeout(1e3 * PATIENCE)

        def asked(request: Any) -> None:
            if not request.url.startswith(("data:", "blob:")) and request.url.split("/")[2] != own:
                errors.append(f"asks {request.url}")

        page.on("request", asked)
        if not expects_errors:
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
        page.goto(address)
        return page

    yield start
    for context in contexts:
        context.close()
    assert errors == []
