"""Pages in bad circumstances: one sentence at the top, and nothing is lost."""

import signal
from pathlib import Path
from typing import Any

from study.diagnose.history import history_of, read_text
from tests.study.bench.conftest import Started, press, running, until
from tests.study.conftest import TwoMasses

HIDDEN = {"mass at tip": 0.006}
IDLE = "state.waiting && !state.busy && !state.waiting.length && versions.candidates && !fetching"


def message(page: Any, of: str) -> str:
    """Sentence at the top of a page, when there is one of a tone."""
    page.wait_for_selector(f"#message.{of}:not([hidden])")
    return str(page.inner_text("#message"))


def test_a_case_without_geometry_is_shown_and_an_edit_by_hand_is_told(
    two_masses: TwoMasses, open_page: Started
) -> None:
    case = two_masses(HIDDEN).resolve()
    with running(case, Path("campaign").resolve()) as bench:
        page = open_page(bench.address)
        until(page, IDLE)
        assert page.locator("#rows tr").count() == 2
        assert page.is_hidden("#structure")
        case.write_text(read_text(case) + "# mine\n")
        assert case.name in message(page, "note")
        until(page, IDLE)
        assert "edited by hand" in page.inner_text("#log li >> nth=2")
        page.close()


def test_pages_of_two_servers_on_one_case_do_not_write_over_each_other(
    two_masses: TwoMasses, open_page: Started
) -> None:
    case = two_masses(HIDDEN).resolve()
    with running(case, Path("campaign").resolve()) as bench, running(case, Path("campaign").resolve()) as other:
        one, two = open_page(bench.address), open_page(other.address)
        for page in (one, two):
            until(page, IDLE)
        press(one, "#candidates button.add >> nth=0")
        until(two, "state.log.some((entry) => entry.name === 'edit')")
        assert case.name in message(two, "note")
        until(two, IDLE)
        until(one, IDLE)
        press(two, "#undo")
        until(one, "state.log.some((entry) => entry.name === 'edit')")
        for page in (one, two):
            until(page, IDLE)
            page.close()
    assert [step.what for step in history_of(case).steps] == ["add", "undo"]


def test_a_fit_goes_on_without_its_page_and_a_new_one_shows_it(two_masses: TwoMasses, open_page: Started) -> None:
    case = two_masses(HIDDEN).resolve()
    with running(case, Path("campaign").resolve()) as bench:
        page = open_page(bench.address)
        until(page, IDLE)
        press(page, "#diagnose")
        until(page, "state.busy !== null")
        page.close()
        page = open_page(bench.address, 1920, "dark")
        page.wait_for_selector("#candidates tbody.named")
        assert "mass at tip" in page.inner_text("#candidates tbody.named")
        page.close()


def test_a_server_that_is_gone_is_told_in_the_page(two_masses: TwoMasses, open_page: Started) -> None:
    case = two_masses(HIDDEN).resolve()
    drawn = read_text(case)
    with running(case, Path("campaign").resolve()) as bench:
        page = open_page(bench.address, expects_errors=True)
        until(page, IDLE)
        bench.end(signal.SIGKILL)
        assert "stickslip bench" in message(page, "error")
        press(page, "#candidates button.add >> nth=0")
        page.wait_for_timeout(500)
        assert page.is_visible("#message.error")
        page.close()
    assert read_text(case) == drawn
