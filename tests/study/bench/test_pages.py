"""Pages in the browser: the story, and bad circumstances that are one sentence at the top and lose nothing.

The story: see the misfit, add the top effect, watch the error fall, drag, undo, export, repeat.
"""

import json
import os
import re
import runpy
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from benchmarks.two_masses import TWO_MASSES, write_two_masses
from study.beam.case import write_beam_case
from study.diagnose.history import history_of, read_text
from tests.slow import slow
from tests.study.bench.conftest import (
    PLACED,
    WITHOUT,
    RunningBench,
    Started,
    await_end,
    children,
    find_faults,
    press,
    running,
    until,
)
from transient.virtual_bench.campaign import CampaignPoints
from transient.virtual_bench.hidden_effect import make_campaign

#: Every third of the beam's frequencies and three levels: a diagnosis takes some twenty seconds.
USUAL = CampaignPoints()
POINTS = CampaignPoints(
    levels=(1.0, 5.0, 10.0), frequencies=USUAL.frequencies[::3], free_frequencies=USUAL.free_frequencies[::4]
)


def test_the_story_by_keyboard_ends_in_a_script_with_the_same_numbers(bench: RunningBench, open_page: Started) -> None:
    tell_story(bench, open_page, run_here)


@slow
def test_the_story_of_a_beam_between_contacts_is_the_same(tmp_path: Path, open_page: Started) -> None:
    case = write_beam_case(tmp_path)
    make_campaign(tmp_path / "campaign", seed=3, kind="mass", place="tip", strength=2e-4, points=POINTS)
    with running(case, tmp_path / "campaign", *WITHOUT) as bench:
        tell_story(bench, open_page, run_as_a_user)
        assert bench.end() == 0


@slow
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (1920, "dark")])
def test_no_state_of_the_page_has_a_serious_fault_of_accessibility(
    bench: RunningBench, open_page: Started, axe: str, width: int, scheme: str
) -> None:
    page = open_page(bench.address, width, scheme)
    wait(page)
    faults = {"compared": find_faults(page, axe)}
    page.evaluate("byId('own').open = true")
    page.fill("#own-text", "candidates = None")
    press(page, "#own-save")
    page.wait_for_selector("#own-note.error")
    faults["a mistake"] = find_faults(page, axe)
    press(page, "#diagnose")
    until(page, "state.busy !== null")
    faults["busy"] = find_faults(page, axe)
    page.wait_for_selector("#candidates tbody.named")
    wait(page)
    faults["diagnosed"] = find_faults(page, axe)
    press(page, "#candidates tbody.named button.add")
    page.wait_for_selector("#verdict.nothing")
    wait(page)
    page.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    faults["added, all unfolded"] = find_faults(page, axe)
    assert not [(state, item) for state, listed in faults.items() for item in listed]
    # What is a fault is found.
    page.evaluate("byId('own-text').removeAttribute('aria-label')")
    assert any(fault.startswith("label:") for fault in find_faults(page, axe))
    page.close()


@slow
def test_beside_typed_data_alone_a_slider_moves_all_that_is_predicted(
    tmp_path: Path, open_page: Started, axe: str
) -> None:
    case = write_two_masses(tmp_path, {}, case=PLACED)
    campaign = tmp_path / "modal"
    campaign.mkdir()
    mode = (
        '[[mode]]\nname = "first"\nconfiguration = "jointed"\nfrequency = "20.6 Hz"\nfrequency_deviation = "0.01 Hz"\n'
    )
    (campaign / "campaign.toml").write_text(f'schema = 1\ntitle = "Modal test"\n{mode}', encoding="utf-8")
    with running(case, campaign) as bench:
        page = open_page(bench.address)
        wait(page)
        drawn = page.inner_text("#data")
        page.focus("input[data-parameter=E]")
        page.keyboard.press("ArrowRight")
        until(page, "exactLines() !== null")
        assert page.inner_text("#data") != drawn
        assert find_faults(page, axe) == []
        press(page, "#back")
        assert page.inner_text("#data") == drawn
        press(page, "#calibrate")
        until(page, "document.querySelector('#history li:not(.pale)') !== null")
        wait(page)
        assert page.locator("#history li", has_text="calibrated").count() == 1
        assert page.inner_text("#data") != drawn
        page.close()
        assert bench.end() == 0


@slow
def test_a_case_without_geometry_is_shown_and_an_edit_by_hand_is_told(bench: RunningBench, open_page: Started) -> None:
    page = open_page(bench.address)
    wait(page)
    assert page.is_visible("#structure")
    bench.case.write_text(read_text(bench.case).replace(PLACED, TWO_MASSES), encoding="utf-8")
    assert bench.case.name in message(page, "note")
    page.wait_for_selector("#structure", state="hidden")
    assert page.locator("#rows tr").count() == 2
    wait(page)
    edits = page.evaluate("state.log.filter((entry) => entry.name === 'edit').length")
    assert page.locator("#log li", has_text="edited by hand").count() == edits > 0
    page.close()


@slow
def test_an_effect_of_ones_own_is_written_in_the_page_and_is_a_candidate(
    bench: RunningBench, open_page: Started
) -> None:
    page = open_page(bench.address)
    wait(page)
    press(page, "#write-own")
    assert page.evaluate("document.activeElement.id") == "own-text"
    source = page.input_value("#own-text")
    line = next(number for number, text in enumerate(source.splitlines(), 1) if "model.places[PLACE]" in text)
    page.fill("#own-name", "mine.py")
    page.fill("#own-text", source.replace("model.places[PLACE]", "model.places[PLACES]"))
    press(page, "#own-save")
    # The sentence names the line, and the editor shows it.
    page.wait_for_selector("#own-note.error")
    assert f"mine.py, line {line}:" in page.inner_text("#own-note")
    chosen = "byId('own-text').value.slice(byId('own-text').selectionStart, byId('own-text').selectionEnd)"
    assert "PLACES" in page.evaluate(chosen)
    assert not (bench.case.parent / "mine.py").exists()
    page.fill("#own-text", source)
    press(page, "#own-save")
    until(page, "byId('own-file').value === 'mine.py'")
    assert "own spring at base" in page.inner_text("#own-note")
    assert (bench.case.parent / "mine.py").read_text(encoding="utf-8") == source
    wait(page)
    page.evaluate("showAll = true; drawEffects()")
    assert page.locator("#candidates b", has_text="own spring at base").count() == 1
    assert page.locator("#log li", has_text="mine.py was written beside").count() == 1
    assert "bench.save_effect(file='mine.py'" in page.evaluate("state.log.map((entry) => entry.python).join()")
    # Another page has the file, and what was typed since is not lost by what is computed.
    page.fill("#own-text", source + "# more\n")
    page.evaluate("call('compare')")
    wait(page)
    assert page.input_value("#own-text") == source + "# more\n"
    other = open_page(bench.address)
    wait(other)
    other.evaluate("byId('own').open = true")
    assert other.input_value("#own-text") == source
    for item in (page, other):
        item.close()


@slow
def test_a_recovered_law_is_edited_and_saved_as_an_effect(bench: RunningBench, open_page: Started) -> None:
    page = open_page(bench.address)
    wait(page)
    source = page.input_value("#own-text") + "# recovered\n"
    # A diagnosis that recovers a law takes minutes; the page is shown one.
    law = {"sentences": ["It hardens."], "picture": "", "name": "law", "file": "recovered_law.py", "text": source}
    page.evaluate("law => beginLaw(law)", law)
    assert "It hardens." in page.inner_text("#law")
    press(page, "#law button")
    assert page.evaluate("document.activeElement.id") == "own-text"
    assert page.input_value("#own-name") == "recovered_law.py"
    assert page.input_value("#own-text") == source
    press(page, "#own-save")
    until(page, "byId('own-file').value === 'recovered_law.py'")
    assert (bench.case.parent / "recovered_law.py").read_text(encoding="utf-8") == source
    page.close()


@slow
def test_pages_of_two_servers_do_not_write_over_each_other_and_one_that_is_killed_loses_nothing(
    bench: RunningBench, open_page: Started
) -> None:
    case, drawn = bench.case, read_text(bench.case)
    with running(case, bench.campaign, *WITHOUT) as other:
        one, two = open_page(bench.address), open_page(other.address, expects_errors=True)
        for page in (one, two):
            wait(page)
        edits = "state.log.filter((entry) => entry.name === 'edit').length"
        before = one.evaluate(edits)
        press(one, "#candidates button.add >> nth=0")
        until(two, f"{edits} === 1")
        assert case.name in message(two, "note")
        for page in (two, one):
            wait(page)
        press(two, "#undo")
        until(one, f"{edits} === {before + 1}")
        for page in (one, two):
            wait(page)
        assert [step.what for step in history_of(case).steps] == ["add", "undo"]
        press(two, "#diagnose")
        two.wait_for_selector("#candidates tbody.named")
        workers = children(other.process.pid)
        assert workers
        other.end(signal.SIGKILL)
        assert "stickslip bench" in message(two, "error")
        press(two, "#candidates button.add >> nth=0")
        two.wait_for_timeout(500)
        assert two.is_visible("#message.error")
        # What it computed is stored: whoever screens the case next shows it without a click on Diagnose.
        one.evaluate("call('screen')")
        one.wait_for_selector("#candidates tbody.named")
        await_end(workers)
        for page in (one, two):
            page.close()
    assert read_text(case) == drawn


def message(page: Any, of: str) -> str:
    """Sentence at the top of a page, when there is one of a tone."""
    page.wait_for_selector(f"#message.{of}:not([hidden])")
    return str(page.inner_text("#message"))


def tell_story(bench: RunningBench, open_page: Started, run: Callable[[Path, Path], str]) -> None:
    """What a user does first; the hidden effect is a mass at the tip. Its script is run with a cache."""
    case, drawn = bench.case, read_text(bench.case)
    page = open_page(bench.address)
    page.wait_for_selector("#verdict.missing")
    see_the_misfit(page)
    page.wait_for_selector("#candidates tbody tr")
    # The list and its chart are asked for at once; either may come first.
    until(page, "errors !== null && errors.length > 0")
    wait(page)
    see_a_mode_move(page)
    # The fit goes on without its page, and another one shows it.
    press(page, "#diagnose")
    until(page, "state.busy !== null")
    page.close()
    page = open_page(bench.address, 1920, "dark")
    page.wait_for_selector("#candidates tbody.named")
    assert "mass at tip" in page.inner_text("#candidates tbody.named")
    wait(page)
    # The chart shows what is proposed: nominal, calibrated, with the mass.
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
    script = case.parent / "repeat.py"
    download.value.save_as(script)
    page.close()
    # Every number of the page is printed again.
    printed = [json.loads(line) for line in run(script, case.parent / "cache").splitlines()]
    assert printed == [entry["numbers"] for entry in state]
    assert read_text(case) == drawn


def see_the_misfit(page: Any) -> None:
    """The worst place is a button, which goes to its sensor, level and frequency."""
    button = page.locator("#worst button").first
    name, frequency = re.match(r"(\w+) · .* at ([\d.]+) Hz", button.inner_text()).groups()  # type: ignore[union-attr]
    press(page, "#worst button >> nth=0")
    assert page.evaluate("responses.panels[shown.panel].sensor") == name
    assert page.evaluate("shown.frequency") == pytest.approx(float(frequency))


def see_a_mode_move(page: Any) -> None:
    """A shape that is chosen moves until another choice ends it."""
    assert page.is_visible("#structure canvas")
    place = "JSON.stringify(byId('structure').data[0].z)"
    before = page.evaluate(place)
    page.focus("#mode")
    page.keyboard.press("ArrowDown")
    until(page, f"{place} !== {json.dumps(before)}")
    page.keyboard.press("ArrowUp")
    until(page, f"{place} === {json.dumps(before)}")


def drag_a_parameter(page: Any) -> None:
    """The dashed curve follows the slider by sensitivities, and then becomes the exact one near it."""
    slider = page.locator("input[data-parameter=E]")
    slider.focus()
    page.keyboard.press("ArrowRight")
    curve = "JSON.stringify(byId('response').data[movedTraces[0].index].y)"
    line = "JSON.stringify(responses.panels[shown.panel].groups[0].line.amplitude)"
    near, drawn = (json.loads(page.evaluate(item)) for item in (curve, line))
    until(page, "exactLines() !== null")
    exact = json.loads(page.evaluate(curve))
    moved = max(abs(a - b) for a, b in zip(exact, drawn, strict=True))
    # A step of the slider is small beside the width of the resonance: sensitivities tell nine tenths of it. The exact
    # curve may have come before the near one was read.
    assert max(abs(a - b) for a, b in zip(exact, near, strict=True)) < 0.1 * moved


def run_as_a_user(script: Path, cache: Path) -> str:
    """What a script prints in a process of its own."""
    environment = {**os.environ, "STICKSLIP_CACHE": str(cache)}
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True, env=environment)
    return done.stdout


def run_here(script: Path, cache: Path) -> str:
    """What a script prints in this process, whose imports are there."""
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(StringIO()) as printed:
        patch.setenv("STICKSLIP_CACHE", str(cache))
        runpy.run_path(str(script), run_name="__main__")
    return printed.getvalue()


def bars(page: Any) -> int:
    """Number of steps in the chart of errors."""
    return int(page.evaluate("errors ? errors.length : 0"))


def proposed(page: Any) -> bool:
    """Whether the last step of the chart is one that was not taken yet."""
    return bool(page.evaluate("errors[errors.length - 1].proposed"))


def wait(page: Any) -> None:
    """Until nothing runs or waits, and all of it is drawn."""
    until(page, "versions.candidates && !state.busy && !state.waiting.length && !fetching")
