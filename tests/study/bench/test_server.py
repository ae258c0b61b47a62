"""The server as a process: it answers its page alone, writes what was seen alone, and is cancelled at once."""

import json
import signal
import socket
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from geometry.errors import InputError
from study.bench import server
from study.bench.server import open_socket, serve_bench, write_palette
from study.bench.work import BenchFiles
from study.diagnose.history import history_of, read_text
from tests.study.bench.conftest import PATIENCE, RunningBench, children


def ask(bench: RunningBench, path: str, headers: Mapping[str, str] | None = None, body: object = None) -> bytes:
    """Answer to a request."""
    data = None if body is None else json.dumps(body).encode()
    with urlopen(Request(bench.address + path, data=data, headers=dict(headers or {})), timeout=30) as answer:
        content: bytes = answer.read()
    return content


def click(bench: RunningBench, name: str, **arguments: Any) -> dict[str, Any]:
    """State after a click."""
    state: dict[str, Any] = json.loads(ask(bench, "call", body={"name": name, "arguments": arguments}))
    return state


def state_of(bench: RunningBench, until: Callable[[dict[str, Any]], bool] = lambda _: True) -> dict[str, Any]:
    """State, when it is as it should be."""
    end = time.monotonic() + PATIENCE
    while True:
        state: dict[str, Any] = json.loads(ask(bench, "state"))
        if until(state):
            return state
        assert time.monotonic() < end, state
        time.sleep(0.1)


def is_idle(state: dict[str, Any]) -> bool:
    return state["busy"] is None and not state["waiting"]


def test_cancel_ends_the_process_that_computes_and_the_same_click_goes_on(bench: RunningBench) -> None:
    state_of(bench, lambda state: state["busy"] is not None)
    assert len(children(bench.process.pid)) == 1
    assert is_idle(click(bench, "cancel"))
    assert children(bench.process.pid) == []
    click(bench, "compare")
    assert state_of(bench, is_idle)["log"][-1]["name"] == "compare"


def test_other_origins_other_hosts_and_other_tokens_get_nothing(bench: RunningBench) -> None:
    assert b"<title>" in ask(bench, "")
    port = bench.address.split("/")[2].split(":")[1]
    for headers in (
        {"Origin": "http://evil.example"},
        {"Host": f"evil.example:{port}"},
        {"Sec-Fetch-Site": "cross-site"},
    ):
        for path in ("", "state", "static/page.js", "script"):
            with pytest.raises(HTTPError) as refused:
                ask(bench, path, headers)
            assert refused.value.code == 403
            assert "Access-Control-Allow-Origin" not in refused.value.headers
    with pytest.raises(HTTPError) as refused:
        urlopen(f"http://127.0.0.1:{port}/state")
    assert refused.value.code == 403
    for path in ("static/..%2f..%2fserver.py", "static/server.py", "view/nothing"):
        with pytest.raises(HTTPError) as missing:
            ask(bench, path)
        assert missing.value.code == 404


def test_a_click_writes_the_case_and_a_page_that_saw_another_one_does_not(bench: RunningBench) -> None:
    case, drawn = bench.case, read_text(bench.case)
    click(bench, "screen")
    state_of(bench, is_idle)
    seen = json.loads(ask(bench, "view/verdict"))["seen"]
    click(bench, "add", effect="mass at tip", values=["6 g"], seen=seen)
    state_of(bench, lambda state: is_idle(state) and state["log"][-1]["name"] == "screen")
    assert 'effect = "mass at tip"' in read_text(case)
    # The second page has not seen the first one's step.
    click(bench, "undo", seen=seen)
    assert state_of(bench, is_idle)["message"]["tone"] == "error"
    assert [step.what for step in history_of(case).steps] == ["add"]
    case.write_bytes((read_text(case) + "# mine\n").encode())
    state_of(bench, lambda state: is_idle(state) and any(entry["name"] == "edit" for entry in state["log"]))
    click(bench, "undo", seen=json.loads(ask(bench, "view/verdict"))["seen"])
    # The log ends alike after the edit, so that the undo need not have begun.
    state_of(
        bench,
        lambda state: (
            is_idle(state)
            and [entry["name"] for entry in state["log"]][-2:] == ["compare", "screen"]
            and [step.what for step in history_of(case).steps] != ["add"]
        ),
    )
    assert read_text(case) == drawn + "# mine\n"
    case.write_text("schema = 2\nthis is no case")
    assert state_of(bench, lambda state: is_idle(state) and (state["message"] or {}).get("tone") == "error")
    case.write_text(drawn)
    state_of(bench, lambda state: is_idle(state) and state["log"][-1]["name"] == "screen")
    assert bench.end(signal.SIGTERM) == 0


def test_a_taken_port_is_a_sentence_with_the_port() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=str(port)):
            open_socket(port)
    with pytest.raises(InputError, match="70000"):
        open_socket(70000)


def test_without_aiohttp_a_sentence_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"pip install -e"):
        serve_bench(BenchFiles(case=Path("a.toml"), folder=Path("b")), 0, opened=lambda _: None)


def test_words_have_the_contrast_of_wcag_aa_on_both_pages() -> None:
    from figure.style import DARK_PAGE, LIGHT_PAGE

    def luminance(colour: str) -> float:
        parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    for page in (LIGHT_PAGE, DARK_PAGE):
        for ground in ("paper", "ground", "marked"):
            for words in ("ink", "pale", "blue", "accent", "good", "bad"):
                dark, bright = sorted(luminance(page[name]) for name in (ground, words))
                assert (bright + 0.05) / (dark + 0.05) >= 4.5, (ground, words)
        assert all(f"--{name}: {colour};" in write_palette() for name, colour in page.items())
