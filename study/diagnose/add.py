"""``stickslip add`` and ``stickslip undo``: write an effect into a case or remove it, and record it in the history."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from casefile.table import SCHEMA
from diagnosis.candidate.effect import EffectError
from geometry.errors import InputError
from study.case.added import find_effect, list_case_effects, make_parameter_key, read_parameter
from study.case.setup import Setup, read_case
from study.diagnose.edit import Written, edit_case, list_changes, revert_change
from study.diagnose.history import (
    ADD,
    DIAGNOSIS,
    UNDO,
    Errors,
    History,
    HistoryStep,
    hash_case,
    history_of,
    read_text,
    write_beside,
)
from study.kind.registry import open_case
from study.measured_campaign import read_measured
from study.run_context import RunContext, silent_run

#: Largest number of case files that a message lists.
LISTED = 5


class CaseEditError(InputError):
    """An edit of a case that cannot be made or undone."""


def add(case: Path, name: str, values: Sequence[str] = (), run: RunContext | None = None) -> HistoryStep:
    """Write an effect into a case.

    Parameters
    ----------
    case
        A case file.
    name
        Name of the effect.
    values
        Value of each of its parameters, with a unit; by default the values of the last diagnosis.
    run
        Store and progress for the structure.

    Returns
    -------
    The step in the history.

    Raises
    ------
    CaseEditError
        No diagnosis to take the strength from, or an effect that the case already has.
    EffectError
        An unknown effect, or a value that does not fit it.
    CaseError, OutputError
        A case that cannot be read or written.
    """
    open_case(case)
    text, history = read_text(case), history_of(case)
    step = _take_given(case, history, name, values, run) if values else _take_diagnosed(case, history, text, name, run)
    written = {effect: as_written(values) for effect, values in step.pop("added").items()}
    written[step["effect"]] = as_written(step["values"])
    new = edit_case(text, written, as_written(step["calibrated"]), str(case))
    noted = HistoryStep(
        what=ADD,
        **step,
        case_before=text,
        case_after=new,
        diff=list_changes(text, new, case.name),
        case_key=hash_case(new),
    )
    return save_step(case, history, noted, new)


def undo(case: Path) -> HistoryStep:
    """Remove the last added effect from a case; later edits elsewhere are kept.

    Parameters
    ----------
    case
        A case file.

    Returns
    -------
    The step in the history.

    Raises
    ------
    CaseEditError
        Nothing was added, or the lines of the effect were edited since.
    CaseError, OutputError
        A history that is damaged, a case that cannot be written.
    """
    history = history_of(case)
    if not history.active_steps:
        raise CaseEditError(f"{case}: nothing was added by stickslip, so there is nothing to undo")
    last = history.active_steps[-1]
    try:
        text = read_text(case)
    except OSError as error:
        raise CaseEditError(f"{case}: cannot be read ({error.strerror}): check its name and folder") from None
    old = revert_change(last.case_before, last.case_after, text)
    if old is None or not _is_toml(old):
        raise CaseEditError(
            f'{case}: the lines of "{last.effect}" were edited since they were written: take that edit back, or '
            "remove them by hand"
        )
    noted = HistoryStep(
        what=UNDO, effect=last.effect, before=last.after, after=last.before, case_before=text, case_after=old,
        diff=list_changes(text, old, case.name), case_key=hash_case(old),
    )  # fmt: skip
    return save_step(case, history, noted, old)


def read_effect_name(words: Sequence[str]) -> str:
    """The name of an effect from the words of a command line.

    Raises
    ------
    CaseEditError
        There are none.
    """
    name = " ".join(" ".join(words).split())
    if not name:
        raise CaseEditError('no effect is named: give one as the diagnosis writes it, e.g. stickslip add "mass at tip"')
    return name


def find_case(folder: Path) -> Path:
    """The only case of a folder, or the only one with a history.

    Raises
    ------
    CaseEditError
        There is none, or there are several.
    """
    cases = {file: case for file in sorted(folder.glob("*.toml")) if (case := _read_tables(file)) is not None}
    # A refined version of another case does not count.
    finer = {(folder / name).resolve() for case in cases.values() for name in _list_refined(case)}
    files = [file for file in cases if file.resolve() not in finer]
    files = [file for file in files if cases[file]["schema"] == SCHEMA] or files
    if len(files) > 1:
        files = [file for file in files if history_of(file).steps] or files
    if len(files) == 1:
        return files[0]
    listed = ", ".join(file.name for file in files[:LISTED]) + (", ..." if len(files) > LISTED else "")
    count = f"{len(files)} cases ({listed})" if files else "no case"
    raise CaseEditError(f"there {'are' if files else 'is'} {count} in {folder.resolve()}: name the case with --case")


def _take_diagnosed(case: Path, history: History, text: str, name: str, run: RunContext | None) -> dict[str, Any]:
    """Fields of the step with the values of the last diagnosis."""
    key = hash_case(text)
    steps = [step for step in history.steps if step.what == DIAGNOSIS and step.case_key == key]
    if not steps:
        why = "the case was edited since its last diagnosis" if history.last_diagnosis else "it has no diagnosis"
        _check_name(case, history, name, run)
        raise CaseEditError(
            f'{case}: {why}, from which to take the strength of "{name}": run stickslip diagnose, or give --value'
        )
    wanted = " ".join(name.split()).casefold()
    diagnosis = steps[-1]
    candidate = next((item for item in diagnosis.candidates if item["effect"].casefold() == wanted), None)
    if candidate is None:
        effect = _check_name(case, history, name, run)
        raise CaseEditError(
            f'{case}: the last diagnosis did not fit "{effect}", because others seemed to explain the measurements '
            "better, or because the case lacks its place: give its strength with --value"
        )
    # An effect of the case is fitted with all others, and is no candidate.
    return {
        **{name: candidate[name] for name in ("effect", "values", "added", "calibrated")},
        **{name: getattr(diagnosis, name) for name in ("campaign", "before", "drawn", "accepted")},
        "after": Errors.read(candidate["after"]),
    }


def _take_given(
    case: Path, history: History, name: str, texts: Sequence[str], run: RunContext | None
) -> dict[str, Any]:
    """Fields of the step with the values of the user."""
    setup = _read_setup(case, history, run)
    effect = find_effect(list_case_effects(setup.model, setup.effect_files, [name]), name)
    if len(texts) != len(effect.parameters):
        listed = ", ".join(make_parameter_key(parameter) for parameter in effect.parameters)
        raise EffectError(f'"{effect.name}" has {len(effect.parameters)} values ({listed}), not {len(texts)}')
    values: dict[str, Written] = {}
    for text, parameter in zip(texts, effect.parameters, strict=True):
        try:
            value = read_parameter(text, parameter)
        except EffectError as error:
            raise EffectError(f'--value "{text}": {error}') from None
        values[make_parameter_key(parameter)] = Written(
            value=value if parameter.unit == "-" else " ".join(text.split())
        )
    return {"effect": effect.name, "values": values, "added": {}, "calibrated": {}}


def as_written(values: Mapping[str, Sequence[Any]]) -> dict[str, Written]:
    """Values in the form of the history."""
    return {key: Written(*value) for key, value in values.items()}


def _check_name(case: Path, history: History, name: str, run: RunContext | None) -> str:
    """The name of an effect in the spelling of the catalogue; an effect that the case already has is refused."""
    setup = _read_setup(case, history, run)
    effect = find_effect(list_case_effects(setup.model, setup.effect_files, [name]), name)
    if effect.name in [item.effect.name for item in setup.added]:
        raise CaseEditError(
            f'{case}: "{effect.name}" is in the case already, and fitted in every diagnosis: change its value with '
            "--value"
        )
    return effect.name


def _read_setup(case: Path, history: History, run: RunContext | None) -> Setup:
    """The case, with the sensors of the campaign of its diagnosis if that still exists."""
    folder = Path("" if history.last_diagnosis is None else history.last_diagnosis.campaign)
    is_there = history.last_diagnosis is not None and (folder / "campaign.toml").is_file()
    return read_case(case, read_measured(folder, run or silent_run()) if is_there else None, run).setup


def save_step(case: Path, history: History, step: HistoryStep, text: str) -> HistoryStep:
    """Write history and case, or neither."""
    longer = history.with_step(step)
    longer.save()
    try:
        write_beside(case, text)
    except InputError:
        history.save()
        raise
    return longer.steps[-1]


def _read_tables(file: Path) -> dict[str, Any] | None:
    """Tables of a case file, also of an earlier schema; None for any other file."""
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8-sig")) if file.is_file() else {}
    except (OSError, ValueError, RecursionError):
        return None
    described = any(isinstance(data.get(table), dict) for table in ("structure", "model"))
    return data if "schema" in data and described else None


def _list_refined(case: dict[str, Any]) -> list[str]:
    table = case.get("numerical_error")
    names = table.get("refined") if isinstance(table, dict) else None
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def _is_toml(text: str) -> bool:
    try:
        tomllib.loads(text.removeprefix("\ufeff"))
    except (ValueError, RecursionError):
        return False
    return True
