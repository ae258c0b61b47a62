"""Nobody but the page itself, on this computer and with the token, gets anything."""

import pytest

from study.bench.request_check import find_rejection_reason

TOKEN, PORT = "t0ken", 8350
OWN = {"Host": "127.0.0.1:8350", "Origin": "http://127.0.0.1:8350", "Sec-Fetch-Site": "same-origin"}


@pytest.mark.parametrize(
    "headers", [OWN, {"Host": "localhost:8350"}, {"Host": "127.0.0.1:8350", "Sec-Fetch-Site": "none"}]
)
def test_the_page_itself_and_a_typed_address_are_answered(headers: dict[str, str]) -> None:
    assert find_rejection_reason(headers, TOKEN, TOKEN, PORT) is None


@pytest.mark.parametrize(
    "change",
    [
        {"Host": "evil.example:8350"},  # a name that was bound to this computer
        {"Host": "127.0.0.1"},
        {"Host": ""},
        {"Origin": "http://evil.example"},
        {"Origin": "https://127.0.0.1:8350"},
        {"Origin": "http://127.0.0.1:8351"},  # another server of this computer
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_other_hosts_and_origins_are_refused_even_with_the_token(change: dict[str, str]) -> None:
    assert find_rejection_reason(OWN | change, TOKEN, TOKEN, PORT)


@pytest.mark.parametrize("given", ["", "t0ke", "t0kenn", "T0KEN", "ü"])
def test_without_the_token_nothing_is_answered(given: str) -> None:
    assert find_rejection_reason(OWN, given, TOKEN, PORT)
