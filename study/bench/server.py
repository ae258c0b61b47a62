"""The local server of the bench: the page, its state and its clicks, only for this computer."""

import asyncio
import contextlib
import secrets
import signal
import socket
import sys
from collections.abc import Awaitable, Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from geometry.errors import InputError
from study.bench.request_check import HEADERS, NAMES, find_rejection_reason
from study.bench.session import Session
from study.bench.work import BenchFiles
from study.bench.worker import Worker
from study.page.html import LOG_SCALE

if TYPE_CHECKING:
    from aiohttp import web

STATIC = Path(__file__).with_name("static")
#: Longest wait of a page for a new state, without and with a running computation [s].
LONGEST_WAIT, RUNNING_WAIT = 5.0, 0.9
#: Interval of checks for changes of case and campaign [s].
LOOK_EVERY = 1.0
MISSING = (
    'stickslip bench needs aiohttp, which is not installed: sh install.sh, or in a checkout pip install -e ".[bench]"'
)
KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}


class BenchApplication:
    """Web application of one session.

    Parameters
    ----------
    session
        State of the session.
    token
        Token that is part of every address.
    port
        Port of the server.
    """

    def __init__(self, session: Session, token: str, port: int) -> None:
        self.session, self.token, self.port = session, token, port

    def make_app(self) -> "web.Application":
        """Make the application: routes, with a check of every request."""
        from aiohttp import web

        @web.middleware
        async def guard(
            request: web.Request, handler: Callable[[web.Request], Awaitable[web.StreamResponse]]
        ) -> web.StreamResponse:
            given = request.path.split("/")[1]
            refusal = find_rejection_reason(request.headers, given, self.token, self.port)
            if refusal is not None:
                return web.Response(status=403, text=f"{refusal}\n", headers=HEADERS)
            response = await handler(request)
            response.headers.update(HEADERS)
            return response

        app = web.Application(middlewares=[guard], client_max_size=64 * 1024)
        routes = [
            web.get("/{token}/", self._page),
            web.get("/{token}/static/{name}", self._file),
            web.get("/{token}/state", self._state),
            web.get("/{token}/view/{name}", self._view),
            web.get("/{token}/script", self._script),
            web.post("/{token}/call", self._call),
        ]
        app.add_routes(routes)
        return app

    async def _page(self, request: "web.Request") -> "web.StreamResponse":
        del request
        return _answer_file(STATIC / "page.html")

    async def _file(self, request: "web.Request") -> "web.StreamResponse":
        name = request.match_info["name"]
        if name == "plotly.js":
            return _answer_file(find_plotly())
        if name == LOG_SCALE.name:
            return _answer_file(LOG_SCALE)
        from aiohttp import web

        if name == "palette.css":
            return web.Response(text=write_palette(), content_type="text/css")
        # Only names of files in the folder are valid.
        known = {file.name: file for file in STATIC.iterdir() if file.suffix in KINDS}
        return _answer_file(known[name]) if name in known else web.Response(status=404)

    async def _state(self, request: "web.Request") -> "web.StreamResponse":
        from aiohttp import web

        seen, waited = request.query.get("seen", ""), 0.0
        while str(self.session.revision) == seen and waited < (RUNNING_WAIT if self.session.running else LONGEST_WAIT):
            await asyncio.sleep(0.05)
            waited += 0.05
        return web.json_response(self.session.state)

    async def _view(self, request: "web.Request") -> "web.StreamResponse":
        from aiohttp import web

        result = self.session.views.get(request.match_info["name"])
        if result is None:
            return web.Response(status=404)
        return web.Response(body=result[1], content_type="application/json")

    async def _script(self, request: "web.Request") -> "web.StreamResponse":
        from aiohttp import web

        del request
        name = f"{self.session.place.case.stem}_bench.py"
        headers = {"Content-Disposition": f'attachment; filename="{name}"'}
        return web.Response(text=self.session.script, content_type="text/x-python", headers=headers)

    async def _call(self, request: "web.Request") -> "web.StreamResponse":
        from aiohttp import web

        try:
            asked = await request.json()
            name, arguments = str(asked["name"]), dict(asked.get("arguments", {}))
        except (ValueError, KeyError, TypeError):
            return web.Response(status=400, text="a click has a name and arguments\n")
        if name == "cancel":
            self.session.cancel()
        else:
            self.session.ask(name, arguments)
        return web.json_response(self.session.state)


def serve_bench(place: BenchFiles, port: int, *, opened: Callable[[str], None]) -> None:
    """Serve until Ctrl-C or SIGTERM.

    Parameters
    ----------
    place
        Case, campaign and store.
    port
        Port on the loopback interface; 0 for any free port.
    opened
        Function that receives the address when the server is ready.

    Raises
    ------
    InputError
        aiohttp is missing, or the port is in use.
    """
    if find_spec("aiohttp") is None:
        raise InputError(MISSING)
    with open_socket(port) as listener:
        asyncio.run(_serve(place, listener, opened))


def open_socket(port: int) -> socket.socket:
    """Open a socket that listens on the loopback interface.

    Raises
    ------
    InputError
        The port is in use or forbidden.
    """
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((NAMES[0], port))
        listener.listen()
    except (OSError, OverflowError) as error:
        listener.close()
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"--port {port} cannot be used ({reason}): give another one, or 0 for any free one") from None
    return listener


def find_plotly() -> Path:
    """Find the script plotly.min.js in the package plotly."""
    package = find_spec("plotly")
    assert package is not None
    assert package.origin is not None
    return Path(package.origin).parent / "package_data" / "plotly.min.js"


def write_palette() -> str:
    """Write the style sheet of light and dark colours; `data-theme` of the page overrides the choice of the system."""
    from figure.style import DARK_PAGE, LIGHT_PAGE

    def rule(selector: str, colours: Mapping[str, str], scheme: str) -> str:
        listed = " ".join(f"--{name}: {colour};" for name, colour in colours.items())
        return f"{selector} {{ color-scheme: {scheme}; {listed} }}"

    dark = rule(':root:not([data-theme="light"])', DARK_PAGE, "dark")
    return "\n".join(
        [
            rule(":root", LIGHT_PAGE, "light"),
            f"@media (prefers-color-scheme: dark) {{ {dark} }}",
            rule(':root[data-theme="dark"]', DARK_PAGE, "dark"),
        ]
    )


async def _serve(place: BenchFiles, listener: socket.socket, opened: Callable[[str], None]) -> None:
    from aiohttp import web

    loop, port, token = asyncio.get_running_loop(), listener.getsockname()[1], secrets.token_urlsafe(24)
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(ValueError, RuntimeError):  # a thread of a test cannot handle signals
            loop.add_signal_handler(number, stop.set)
    session: Session

    def receive(message: Mapping[str, Any]) -> None:
        loop.call_soon_threadsafe(session.receive, message)

    worker = Worker(place, receive)
    session = Session(place=place, worker=worker)
    runner = web.AppRunner(BenchApplication(session, token, port).make_app(), access_log=None, shutdown_timeout=0.5)
    await runner.setup()
    try:
        await web.SockSite(runner, listener).start()
        session.begin()
        opened(f"http://{NAMES[0]}:{port}/{token}/")
        while not stop.is_set():
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(stop.wait(), LOOK_EVERY)
            session.check_for_changes()
    finally:
        worker.end()
        await runner.cleanup()


def _answer_file(file: Path) -> "web.StreamResponse":
    from aiohttp import web

    if not file.is_file():
        sys.stderr.write(f"stickslip: warning: {file} is missing: install stickslip again\n")
        return web.Response(status=404)
    return web.Response(body=file.read_bytes(), content_type=KINDS[file.suffix], charset="utf-8")
