"""Repetition of a command on copies of its inputs, and comparison of the new result with the old one."""

import os
import shutil
from collections.abc import Mapping
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from geometry.errors import InputError
from study.case.trust import require_trust
from study.diagnose.history import name_history_file
from study.difference import find_differences
from study.json_value import to_json
from study.provenance import Provenance, hash_content, list_versions
from study.repeat.source import RepeatableResult, keep_results, read_result
from study.run_context import RunContext
from study.run_record import recorded

#: Commands that write results and change no other file; for security, no other command of a page is run.
REPEATABLE = {
    "compare",
    "diagnose",
    "estimate",
    "limits",
    "modes",
    "plan",
    "reduce",
    "solve",
    "spread",
    "sweep",
    "table1",
}
#: Subfolders of the output folder: copies of the inputs, and stored results during the run.
INPUT, CACHE = "input", ".repeat_cache"


@dataclass(frozen=True, kw_only=True)
class RepeatResult:
    """Comparison of a repeated result with the original.

    Parameters
    ----------
    command
        Words after ``stickslip``.
    changes
        Sentences on changed data and versions.
    differences
        Result of `find_differences`.
    """

    command: tuple[str, ...]
    changes: tuple[str, ...]
    differences: Mapping[str, Any]

    @property
    def same(self) -> bool:
        """Whether all values are equal within round-off."""
        return not self.differences["different"]


def repeat_result(path: Path, run: RunContext, stored: Path, folder: Path | None = None) -> RepeatResult:
    """Repeat a result without stored intermediate results.

    Parameters
    ----------
    path
        Page, or output folder of a run.
    run
        Output folder, which also receives copies of the data, and console.
    stored
        Folder of stored results, which contains the records of runs.
    folder
        Folder from which the command was run; None for the recorded one.

    Raises
    ------
    InputError
        If the result has no record of its command, the command cannot be repeated, a file is missing, or code is not
        trusted.
    ComputationFailed
        If the command raises it.
    """
    assert run.output is not None
    result = read_result(path, stored)
    base = (folder or result.folder).resolve()
    _require_repeatable(path, result.provenance)
    changes = compare_conditions(result.provenance, base)
    for change in changes:
        run.warn(change)
    require_trust(_list_code(result.provenance, base), path)
    target = run.output.resolve()
    words, start = _copy_inputs(result.provenance, base, target / INPUT)
    run.note(f"repeats: stickslip {' '.join(words)}")
    values = _run_again(words, start, target, run, path)
    shutil.rmtree(target / CACHE, ignore_errors=True)
    return RepeatResult(
        command=tuple(words), changes=tuple(changes), differences=find_differences(result.values, values)
    )


def compare_conditions(made_by: Provenance, base: Path) -> list[str]:
    """List changes of inputs and versions since a result was made, one sentence each.

    Raises
    ------
    InputError
        If a file is missing.
    """
    missing = [name for name in made_by.inputs if not (base / name).exists()]
    if missing:
        raise InputError(
            f"{', '.join(missing)} is not in {base}: give the folder from which the command was run with --folder"
        )
    changes = [
        f"{name} has changed since the result was made"
        for name, known in made_by.inputs.items()
        if hash_content(base / name) != known
    ]
    now = list_versions()
    changes += [
        f"{name} is now {now.get(name, 'not installed')}, but the result was made with {version}"
        for name, version in made_by.versions.items()
        if now.get(name) != version
    ]
    return changes


def _require_repeatable(path: Path, made_by: Provenance) -> None:
    if made_by.command[0] not in REPEATABLE or "--auto" in made_by.command:
        raise InputError(
            f"{path} was made by `stickslip {' '.join(made_by.command)}`, which changes your files: only these "
            f"commands are repeated: {', '.join(sorted(REPEATABLE))}, without --auto"
        )


def _list_code(made_by: Provenance, base: Path) -> list[Path]:
    """Python files that a command would run."""
    words = [word.rpartition("=")[2] for word in made_by.command]
    files = [base / name for name in dict.fromkeys([*made_by.inputs, *words]) if name.endswith(".py")]
    return [file for file in files if file.is_file()]


def _copy_inputs(made_by: Provenance, base: Path, target: Path) -> tuple[list[str], Path]:
    """Copy the inputs of a command, with the same relative paths between them.

    Returns
    -------
    Words of the command for the copies, and the folder in which to start it.
    """
    shutil.rmtree(target, ignore_errors=True)
    places = {name: Path(os.path.normpath(base / name)) for name in made_by.inputs}
    common = Path(os.path.commonpath([base, *(place.parent for place in places.values())]))
    for place in places.values():
        copy = target / place.relative_to(common)
        if place.is_dir():
            shutil.copytree(place, copy, dirs_exist_ok=True)
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        for file in (place, name_history_file(place)) if place.suffix == ".toml" else (place,):
            if file.is_file():
                shutil.copyfile(file, copy.with_name(file.name))
    start = target / base.relative_to(common)
    start.mkdir(parents=True, exist_ok=True)
    absolute = {name: str(target / places[name].relative_to(common)) for name in places if Path(name).is_absolute()}
    return [absolute.get(word, word) for word in made_by.command], start


def _run_again(words: list[str], start: Path, target: Path, run: RunContext, path: Path) -> dict[str, Any]:
    """Run the command again, and read the values of its new result."""
    from study.cli import run_command

    page = path.is_file()
    options = ["--out", str(target), "--cache", str(target / CACHE), *(["--quiet"] if run.quiet or run.json else [])]
    with chdir(start), recorded([*words, *options]) as answers:
        answer = run_command([*words, *options])
        assert answer is not None  # only help and version return None
        answers.append((answer.exit_code, answer.document))
    if not page:
        values: dict[str, Any] = keep_results(to_json(answer.document))
        return values
    new = target / path.name
    if not new.is_file():
        raise InputError(f"the command writes no {path.name}: give the page its original file name")
    made: RepeatableResult = read_result(new, target)
    return dict(made.values)
