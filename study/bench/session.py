"""State of an open bench: views of the page, running and queued calls, and the log; independent of the network.

All results are in the case file, its history and the stored results, so that nothing is lost with a session.
"""

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from hashlib import sha256
from pathlib import Path
from typing import Any, Protocol

from study.bench.last_view import read_last_views, store_last_views
from study.bench.script import ScriptEntry, format_command, format_python, format_script
from study.bench.work import CALLS, BenchFiles
from study.diagnose.history import name_history_file

#: Calls that write the case, and calls whose results belong to the case at their start.
WRITING, READING = (
    frozenset({"add", "undo", "calibrate", "save_effect"}),
    frozenset({"compare", "screen", "diagnose", "move", "limits"}),
)
#: Calls after which the page shows the current case.
SHOWING = frozenset({"compare", "screen", "diagnose"})
#: Largest number of files of a campaign folder that are checked for changes.
MOST_FILES = 2000
#: Messages to the user.
CANCELLED = "Cancelled. Finished work is stored: the same command continues from there."
ENDED = (
    "The computation ended unexpectedly, most often for lack of memory. Nothing is lost: finished work is stored, and "
    "the same command continues from there."
)
BUSY = "{name} is running: wait for it or cancel it, then click again. Nothing was written."


class Caller(Protocol):
    """Interface of a worker, see `study.bench.worker.Worker`."""

    def call(self, number: int, name: str, arguments: Mapping[str, Any]) -> None:
        """Request a call of the bench."""

    def end(self) -> None:
        """End the process."""


@dataclass(frozen=True, kw_only=True)
class Call:
    """A queued or running call."""

    number: int
    name: str
    arguments: Mapping[str, Any]


@dataclass
class Session:
    """State of an open case and campaign.

    Parameters
    ----------
    place
        Case, campaign and store.
    worker
        Worker whose messages go to `receive`.
    clock
        Function that returns the time [s]; replaced in tests.
    """

    place: BenchFiles
    worker: Caller
    clock: Callable[[], float] = time.monotonic
    revision: int = 0
    views: dict[str, tuple[int, bytes]] = field(default_factory=dict)
    entries: list[ScriptEntry] = field(default_factory=list)
    queue: list[Call] = field(default_factory=list)
    running: Call | None = None
    steps: list[Mapping[str, Any]] = field(default_factory=list)
    message: dict[str, str] | None = None

    def __post_init__(self) -> None:
        self._count = 0
        self._began = self.clock()
        self._text = self._text_of_call = self._first = read_text(self.place.case) or ""
        self._first_history = read_text(name_history_file(self.place.case)) or ""
        self._first_effects: dict[str, str] = {}
        self._campaign = sign_folder(self.place.folder)
        self.views = {name: (1, view) for name, view in read_last_views(self.place, self._shown_texts).items()}
        self.is_last = bool(self.views)

    def begin(self) -> None:
        """Queue the first calls of a page: comparison and screening."""
        self._ask("compare", {})
        self._ask("screen", {})

    def ask(self, name: str, arguments: Mapping[str, Any]) -> None:
        """Handle a click: start the call, queue it, or refuse it with a message."""
        self.message = None
        if name not in CALLS:
            self._set_message("error", f'there is no call "{name}": reload the page')
        elif name in WRITING and self._occupied:
            self._set_message("error", BUSY.format(name=self._occupied))
        elif name == "move":
            self.queue = [call for call in self.queue if call.name != "move"]
            self._ask(name, arguments)
        elif not any(call.name == name for call in self._all if name in READING):
            self._ask(name, arguments)
        self._increment_revision()

    def cancel(self) -> None:
        """End the running call, and empty the queue."""
        if self.running is None and not self.queue:
            return
        self.worker.end()
        self.running, self.queue, self.steps = None, [], []
        self._set_message("note", CANCELLED)

    def receive(self, message: Mapping[str, Any]) -> None:
        """Handle a message of the worker."""
        kind = message["kind"]
        if kind == "progress":
            self.steps = list(message["steps"]) if self.running is not None else []
        elif kind == "warning":
            self._set_message("note", message["sentence"])
        elif kind == "ended":
            self.running, self.queue, self.steps = None, [], []
            self._set_message("error", ENDED)
        elif self.running is not None and message["number"] == self.running.number:
            self.running, self.steps = None, []
            if kind == "failed":
                self._set_message("error", message["sentence"], message["name"])
                self.queue = [call for call in self.queue if call.name in WRITING]
            else:
                self._take(message)
            self._start()
        self._increment_revision()

    def check_for_changes(self) -> None:
        """Check whether another program has changed the case or the campaign."""
        text, campaign = read_text(self.place.case), sign_folder(self.place.folder)
        if self.running is not None and self.running.name in WRITING:
            return  # the running call changes the case
        if text is not None and text != self._text:
            self._text = text
            self.entries.append(self._entry("edit", {"text": text}, {}))
            self._set_message(
                "note", f"{self.place.case.name} was edited by hand or in another page: this is its current state."
            )
            self._restart_reading()
        if campaign and campaign != self._campaign:
            self._campaign = campaign
            self._set_message("note", f"The campaign in {self.place.folder} was replaced: this is the new one.")
            self._restart_reading()

    @property
    def state(self) -> dict[str, Any]:
        """State that a page polls; the page fetches a view when its version has changed."""
        case, folder = self.place.case, self.place.folder
        running = self.running
        return {
            "revision": self.revision,
            "case": case.name,
            "campaign": folder.name,
            "is_last": self.is_last,
            "busy": None if running is None else {"name": running.name, "seconds": self.clock() - self._began},
            "steps": self.steps,
            "waiting": [call.name for call in self.queue],
            "message": self.message,
            "versions": {name: version for name, (version, _) in self.views.items()},
            "log": [
                {
                    "command": format_command(entry, case, folder, self.place.without),
                    "python": format_python(entry),
                    "numbers": dict(entry.numbers),
                    "when": entry.when,
                    "name": entry.name,
                }
                for entry in self.entries
            ],
        }

    @property
    def script(self) -> str:
        """Script that repeats the calls of the log."""
        place = self.place
        return format_script(
            self.entries, place.case, place.folder, place.without, self._first, self._first_history, self._first_effects
        )

    @property
    def _shown_texts(self) -> tuple[str, ...]:
        """Case, history and signature of the campaign that the parts of the page belong to."""
        return self._text, read_text(name_history_file(self.place.case)) or "", self._campaign

    @property
    def _all(self) -> list[Call]:
        return [*([] if self.running is None else [self.running]), *self.queue]

    @property
    def _occupied(self) -> str:
        """Name of the running or queued call that must end before the case is written; empty without one."""
        return next((call.name for call in self._all if call.name != "move"), "")

    def _take(self, message: Mapping[str, Any]) -> None:
        name, views = message["name"], message["views"]
        if name in READING and self._text != self._text_of_call:
            return  # the case has changed since the start of the call
        entry = self._entry(name, message["arguments"], message["numbers"])
        if name == "move" and self.entries and self.entries[-1].name == "move":
            self.entries.pop()
        self.entries.append(entry)
        if name == "save_effect":
            self._keep_first_effect(message["arguments"]["file"])
        for part, document in views.items():
            encoded = json.dumps(document, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode()
            self.views[part] = (self.views.get(part, (0, b""))[0] + 1, encoded)
        if name == "compare" and "limits" in self.views:
            self.views["limits"] = (self.views["limits"][0] + 1, b"null")  # the limits were those of the previous case
        if name in SHOWING:
            self.is_last = self.is_last and name == "compare"
            store_last_views(self.place, self._shown_texts, {part: view for part, (_, view) in self.views.items()})
        if name in WRITING:
            self._text = read_text(self.place.case) or self._text
            self._restart_reading()
        elif name == "screen" and views["is_diagnosed"]:
            self._ask("diagnose", {})

    def _keep_first_effect(self, name: str) -> None:
        """Keep the shown text of an effect file from before its first change, for the script."""
        if sum(item.name == "save_effect" and item.arguments["file"] == name for item in self.entries) > 1:
            return
        _, shown = self.views.get("own", (0, b'{"files": []}'))
        self._first_effects |= {
            item["name"]: item["text"] for item in json.loads(shown)["files"] if item["name"] == name
        }

    def _restart_reading(self) -> None:
        """Repeat the calls that depend on case and campaign."""
        self.queue = [call for call in self.queue if call.name in WRITING]
        self.begin()

    def _ask(self, name: str, arguments: Mapping[str, Any]) -> None:
        self._count += 1
        self.queue.append(Call(number=self._count, name=name, arguments=arguments))
        self._start()

    def _start(self) -> None:
        if self.running is None and self.queue:
            self.running = self.queue.pop(0)
            self._began, self._text_of_call = self.clock(), self._text
            self.worker.call(self.running.number, self.running.name, self.running.arguments)
        self._increment_revision()

    def _entry(self, name: str, arguments: Mapping[str, Any], numbers: Mapping[str, Any]) -> ScriptEntry:
        now = datetime.now().astimezone().isoformat(timespec="seconds")
        return ScriptEntry(name=name, arguments=arguments, numbers=numbers, when=now)

    def _set_message(self, tone: str, text: str, of: str = "") -> None:
        self.message = {"tone": tone, "text": text, "of": of}
        self._increment_revision()

    def _increment_revision(self) -> None:
        self.revision += 1


def read_text(file: Path) -> str | None:
    """Read the text of a file; None if it cannot be read now."""
    try:
        return file.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError):
        return None


def sign_folder(folder: Path) -> str:
    """Hash of names, sizes and times of the files of a folder; empty without files, or if they cannot be read now."""
    try:
        files = sorted(file for file in folder.rglob("*") if file.is_file())[:MOST_FILES]
        facts = [(str(file), file.stat().st_size, file.stat().st_mtime_ns) for file in files]
    except OSError:
        return ""
    return sha256(json.dumps(facts).encode()).hexdigest() if facts else ""
