"""The story in the browser: see the misfit, add the top effect, watch the error fall, drag, undo, export, repeat."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from study.beam.case import write_beam_case
from study.diagnose.history import history_of, read_text
from tests.study.bench.conftest import Started, press, running, until
from transient.virtual_bench.campaign import CampaignPoints
from transient.virtual_bench.hidden_effect import make_campaign

#: Every third of the beam's frequencies and three levels: a diagnosis takes some twenty seconds.
USUAL = CampaignPoints()
POINTS = CampaignPoints(
    levels=(1.0, 5.0, 10.0), frequencies=USUAL.frequencies[::3], free_frequencies=USUAL.free_frequencies[::4]
)
#: Kinds that take the longest to fit, of effects that are not hidden.
WITHOUT = ("spring", "dashpot", "cubic", "gap", "air damping", "density")


def test_the_story_by_keyboard_ends_in_a_script_with_the_same_numbers(tmp_path: Path, open_page: Started) -> None:
    case = write_beam_case(tmp_path)
    drawn = read_text(case)
    make_campaign(tmp_path / "campaign", seed=3, kind="mass", place="tip", strength=2e-4, points=POINTS)
    with running(case, tmp_path / "campaign", "--without", *WITHOUT) as bench:
        page = open_page(bench.address)
        page.wait_for_selector("#verdict.missing")
        see_the_misfit(page)
        page.wait_for_selector("#candidates tbody tr")
        assert bars(page) > 0
        wait(page)
        press(page, "#diagnose")
        page.wait_for_selector("#candidates tbody.named")
        assert "mass at tip" in page.inner_text("#candidates tbody.named")
        wait(page)
        # The chart shows what is proposed: as drawn, calibrated, with the mass.
        assert (bars(page), proposed(page)) == (3, True)
        press(page, "#candidates tbody.named button.add")
        page.wait_for_selector("#verdict.nothing")
        wait(page)
        assert read_text(case) != drawn
        assert [step.what for step in history_of(case).steps] == ["diagnosis", "add"]
        assert (bars(page), proposed(page)) == (3, False)
        drag_a_parameter(page)
        press(page, "#undo")
        page.wait_for_selector("#verdict.missing")
        wait(page)
        assert read_text(case) == drawn
        state = page.evaluate("state.log")
        with page.expect_download() as download:
            press(page, "#export")
        script = tmp_path / "repeat.py"
        download.value.save_as(script)
        page.close()
        assert bench.end() == 0
    compare_with_script(script, state, tmp_path / "cache")
    assert read_text(case) == drawn


def see_the_misfit(page: Any) -> None:
    """The worst place is a button, which goes to its sensor, level and frequency."""
    button = page.locator("#worst button").first
    name, frequency = re.match(r"(\w+) · .* at ([\d.]+) Hz", button.inner_text()).groups()  # type: ignore[union-attr]
    press(page, "#worst button >> nth=0")
    assert page.evaluate("responses.panels[shown.panel].sensor") == name
    assert page.evaluate("shown.frequency") == pytest.approx(float(frequency))


def drag_a_parameter(page: Any) -> None:
    """The dashed curve follows the slider by sensitivities, and then becomes the exact one near it."""
    slider = page.locator("input[data-parameter=E]")
    slider.focus()
    page.keyboard.press("ArrowRight")
    curve = "JSON.stringify(byId('response').data[movedTraces[0].index].y)"
    line = "JSON.stringify(responses.panels[shown.panel].groups[0].line.amplitude)"
    near, drawn = (json.loads(page.evaluate(each)) for each in (curve, line))
    until(page, "exactLines() !== null")
    exact = json.loads(page.evaluate(curve))
    moved = max(abs(a - b) for a, b in zip(exact, drawn, strict=True))
    # A step of the slider is small beside the width of the resonance: sensitivities tell nine tenths of it.
    assert 0 < max(abs(a - b) for a, b in zip(exact, near, strict=True)) < 0.1 * moved


def compare_with_script(script: Path, log: list[dict[str, Any]], cache: Path) -> None:
    """Every number of the page is printed again."""
    environment = {**os.environ, "STICKSLIP_CACHE": str(cache)}
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True, env=environment)
    printed = [json.loads(line) for line in done.stdout.splitlines()]
    assert printed == [entry["numbers"] for entry in log]


def bars(page: Any) -> int:
    """Number of steps in the chart of errors."""
    return int(page.evaluate("errors ? errors.length : 0"))


def proposed(page: Any) -> bool:
    """Whether the last step of the chart is one that was not taken yet."""
    return bool(page.evaluate("errors[errors.length - 1].proposed"))


def wait(page: Any) -> None:
    """Until nothing runs or waits, and all of it is drawn."""
    until(page, "!state.busy && !state.waiting.length && !fetching")
