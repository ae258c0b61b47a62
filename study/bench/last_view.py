"""The last views of a page: the next bench of the same case shows them until the new comparison is finished."""

import contextlib
import json
from collections.abc import Mapping
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

from pipeline.output import replace_file
from study.bench.work import BenchFiles

#: Parts of the page that are not stored.
PASSING = frozenset({"moved"})


def read_last_views(place: BenchFiles, texts: tuple[str, ...]) -> dict[str, bytes]:
    """Read the stored parts of the page, by name; empty if none are stored, or if case or campaign have changed.

    Parameters
    ----------
    place
        Case, campaign and folder of stored results.
    texts
        Text of the case, its history, and signature of the campaign, which the stored parts must match.
    """
    file = _name_file(place)
    if file is None:
        return {}
    try:
        stored = json.loads(file.read_bytes())
        if stored["of"] != _sign(place, texts):
            return {}
        return {name: _encode(view) for name, view in stored["views"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def store_last_views(place: BenchFiles, texts: tuple[str, ...], views: Mapping[str, bytes]) -> None:
    """Store the parts of a page; errors of the disk are ignored, and the next bench begins with an empty page."""
    file = _name_file(place)
    if file is None:
        return
    of = json.dumps(_sign(place, texts))
    listed = ",".join(f"{json.dumps(name)}:{view.decode()}" for name, view in views.items() if name not in PASSING)
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        replace_file(file, f'{{"of":{of},"views":{{{listed}}}}}')


def _name_file(place: BenchFiles) -> Path | None:
    """Return the file for a case and its campaign; new views replace the last ones."""
    if place.cache is None:
        return None
    names = [str(place.case.resolve()), str(place.folder.resolve()), *place.without]
    return place.cache / "bench" / f"{sha256(json.dumps(names).encode()).hexdigest()[:32]}.json"


def _sign(place: BenchFiles, texts: tuple[str, ...]) -> str:
    return sha256(json.dumps([version("stickslip"), *place.without, *texts]).encode()).hexdigest()


def _encode(view: object) -> bytes:
    return json.dumps(view, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode()
