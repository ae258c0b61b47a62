"""A bench as a user starts it, and a browser that notes what a page must not do."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
#: Software drawing, so that the structure is drawn without a graphics card.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
#: Longest wait for a computation on a machine that does much else [s].
PATIENCE = 300.0

Started = Callable[..., Any]


class RunningBench:
    """A process of ``stickslip bench`` and its address."""

    def __init__(self, process: "subprocess.Popen[str]", address: str) -> None:
        self.process, self.address = process, address

    def end(self, number: int = signal.SIGINT) -> int:
        """End it, and return its exit code."""
        self.process.send_signal(number)
        return self.process.wait(30)


@contextmanager
def running(case: Path, campaign: Path, *words: str) -> Iterator[RunningBench]:
    """A bench with a cache beside the case."""
    command = [sys.executable, "-m", "stickslip", "bench", str(case), str(campaign), "--no-browser"]
    command += ["--cache", str(case.parent / "cache"), *words]
    log = case.parent / "bench.err"
    with log.open("w") as stream:
        process = subprocess.Popen(command, stdout=stream, stderr=stream, text=True, env=os.environ.copy())
    try:
        end = time.monotonic() + 60
        while "http://" not in log.read_text() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        text = log.read_text()
        assert "http://" in text, text
        yield RunningBench(process, "http://" + text.split("http://")[1].split()[0])
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(30)


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
        context = chromium.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
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
