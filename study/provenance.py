"""Provenance of a result: the command, hashes of the files that it read, and versions.

Every page contains its provenance. It has no time and no machine name, so that it is the same for the same command and
data.
"""

import hashlib
import importlib.metadata
import json
import os
import platform
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

#: Options that set where a result is written or how it is printed, and whether a value follows the option.
NOT_OF_THE_RESULT = {
    "--out": True, "--cache": True, "--scheduler": True, "--json": False, "--quiet": False, "--trust": False,
}  # fmt: skip
#: Packages whose version may change the last digits.
PACKAGES = ("stickslip", "numpy", "scipy", "numba")


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Provenance of a result.

    Parameters
    ----------
    command
        Words after ``stickslip``, without the output folder and options that change no number; with the seed.
    folder
        Folder in which the command was started, relative to the output folder.
    inputs
        SHA-256 of each file or folder that the words name, and of each file that a case names.
    versions
        Version of Python and of packages.
    """

    command: Sequence[str]
    folder: str
    inputs: Mapping[str, str]
    versions: Mapping[str, str]

    def as_json(self) -> str:
        """Return the provenance as one line of JSON."""
        return json.dumps(asdict(self), ensure_ascii=False)


def make_provenance(words: Sequence[str], output: Path, files: Mapping[str, str]) -> Provenance:
    """Make the provenance of a command that started in the current folder.

    Parameters
    ----------
    words
        Words after ``stickslip``.
    output
        Output folder of the command.
    files
        Hashes of the input files at the start of the command, from `hash_files`.
    """
    command = list_result_words(words)
    return Provenance(
        command=command,
        folder=os.path.relpath(Path.cwd(), output),
        inputs={name: files.get(name) or hash_content(Path(name)) for name in list_inputs(command[1:])},
        versions=list_versions(),
    )


def list_versions() -> dict[str, str]:
    """Version of Python and of packages that the last digits may depend on."""
    return {"python": platform.python_version(), **{name: importlib.metadata.version(name) for name in PACKAGES}}


def hash_files(words: Sequence[str]) -> dict[str, str]:
    """SHA-256 of each file that a command reads, without folders."""
    command = list_result_words(words)
    return {name: hash_content(Path(name)) for name in list_inputs(command[1:]) if Path(name).is_file()}


def list_inputs(words: Sequence[str]) -> list[str]:
    """Files and folders among the words of a command, and the files that case files among them name."""
    named = [word for word in words if Path(word).exists()]
    for case in [Path(word) for word in named if word.endswith(".toml")]:
        with suppress(OSError, ValueError):  # a case that cannot be read is refused by its command
            for text in _list_texts(tomllib.loads(case.read_text(encoding="utf-8"))):
                with suppress(OSError, ValueError):
                    if text and (case.parent / text).is_file():
                        named.append(str(case.parent / text))
    return list(dict.fromkeys(named))


def hash_content(path: Path) -> str:
    """SHA-256 of a file, or of all files of a folder with their names; empty if they cannot be read."""
    total = hashlib.sha256()
    try:
        for file in [path] if path.is_file() else sorted(item for item in path.rglob("*") if item.is_file()):
            total.update(f"{file.relative_to(path)}\0".encode())
            with file.open("rb") as stream:
                total.update(hashlib.file_digest(stream, "sha256").digest())
    except OSError:
        return ""
    return total.hexdigest()


def list_result_words(words: Sequence[str]) -> list[str]:
    """Words of a command without the options in `NOT_OF_THE_RESULT`."""
    kept, left = [], iter(words)
    for word in left:
        name, has_value, _ = word.partition("=")
        if name not in NOT_OF_THE_RESULT:
            kept.append(word)
        elif NOT_OF_THE_RESULT[name] and not has_value:
            next(left, None)
    return kept


def _list_texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _list_texts(item)
    elif isinstance(value, list):
        for item in value:
            yield from _list_texts(item)
