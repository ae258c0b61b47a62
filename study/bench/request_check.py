"""Check of requests: the server answers this computer alone, with the token, from the page itself."""

from collections.abc import Mapping
from hmac import compare_digest

#: Names by which a browser may call this computer.
NAMES = ("127.0.0.1", "localhost")

#: Headers of every answer: the page loads from here alone, is in no frame, and its token goes nowhere.
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}


def find_rejection_reason(headers: Mapping[str, str], given: str, token: str, port: int) -> str | None:
    """Reason to reject a request; None if it is valid.

    Parameters
    ----------
    headers
        Headers of the request, found by any case of their names.
    given
        Token of its address.
    token, port
        Those of the server.
    """
    hosts = [f"{name}:{port}" for name in NAMES]
    if headers.get("Host", "") not in hosts:
        return "this server answers only to 127.0.0.1"
    origin = headers.get("Origin")
    if origin is not None and origin not in [f"http://{host}" for host in hosts]:
        return "requests from another origin are refused"
    if headers.get("Sec-Fetch-Site", "none") not in {"same-origin", "none"}:
        return "requests from another origin are refused"
    if not compare_digest(given.encode(), token.encode()):
        return "the address lacks the token of this bench: open the address that stickslip bench has printed"
    return None
