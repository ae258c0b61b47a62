"""Check of requests: the server answers only requests of its own page on this computer, with the token."""

from collections.abc import Mapping
from hmac import compare_digest

#: Host names of this computer in valid requests.
NAMES = ("127.0.0.1", "localhost")

#: Headers of every response: the page loads only from this server, is not shown in frames, and sends no referrer.
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
        Headers of the request, a mapping that ignores the case of names.
    given
        Token in the address of the request.
    token, port
        Token and port of the server.
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
