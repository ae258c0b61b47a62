"""``stickslip add`` and ``stickslip undo``: an effect is written into a case, or taken out, and the history says so."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from casefile.table import SCHEMA
from correlation.campaign.measurement import Campaign
from correlation.campaign.read_campaign import read_campaign
from diagnosis.candidate.effect import EffectError
from geometry.errors import InputError
from study.case.added import case_catalogue, find_effect, key_of, value_of
from study.case.kind import open_case
from study.case.setup import Setup, read_case
from study.diagnose.edit import Written, difference, edited, taken_back
from study.diagnose.history import (
    ADD,
    DIAGNOSIS,
    UNDO,
    Errors,
    History,
    Step,
    case_key,
    history_of,
    read_text,
    write_beside,
)
from study.diagnose.table import read_values
from study.run_context import RunContext


class LoopError(InputError):
    """A step that cannot be taken, or taken back."""


def add(case: Path, name: str, values: Sequence[str] = (), run: RunContext | None = None) -> Step:
    """Write an effect into a case.

    Parameters
    ----------
    case
        A case file.
    name
        Of the effect.
    values
        One for each of its parameters; by default those of the last diagnosis, which also calibrates all else.
    run
        Where the structure is stored.

    Returns
    -------
    What was noted in the history.

    Raises
    ------
    LoopError
        No diagnosis to take the strength from, or an effect that is there already.
    EffectError
        An unknown effect, or a value that does not fit it.
    CaseError, OutputError
        A case that cannot be read or written.
    """
    open_case(case)
    text, history = read_text(case), history_of(case)
    step = _given(case, history, name, values, run) if values else _diagnosed(case, history, text, name, run)
    added = {each: read_values(of) for each, of in step.pop("added").items()}
    added[step["effect"]] = read_values(step["values"])
    new = edited(text, added, read_values(step["calibrated"]), str(case))
    noted = Step(
        what=ADD,
        **step,
        case_before=text,
        case_after=new,
        diff=difference(text, new, case.name),
        case_key=case_key(new),
    )
    return _saved(case, history, noted, new)


def undo(case: Path) -> Step:
    """Take the last added effect out of a case again; what was edited elsewhere since stays.

    Parameters
    ----------
    case
        A case file.

    Returns
    -------
    What was noted in the history.

    Raises
    ------
    LoopError
        Nothing was added, or the very lines were edited since.
    CaseError, OutputError
        A history that is damaged, a case that cannot be written.
    """
    history = history_of(case)
    if not history.standing:
        raise LoopError(f"{case}: nothing was added by stickslip, so that nothing can be taken back")
    last = history.standing[-1]
    try:
        text = read_text(case)
    except OSError as error:
        raise LoopError(f"{case}: cannot be read ({error.strerror}): check its name and folder") from None
    old = taken_back(last.case_before, last.case_after, text)
    if old is None or not _is_toml(old):
        raise LoopError(
            f'{case}: the lines that hold "{last.effect}" were edited since it was added: take that edit back, or '
            "remove them by hand"
        )
    noted = Step(
        what=UNDO, effect=last.effect, before=last.after, after=last.before, case_before=text, case_after=old,
        diff=difference(text, old, case.name), case_key=case_key(old),
    )  # fmt: skip
    return _saved(case, history, noted, old)


def named(words: Sequence[str]) -> str:
    """The name of an effect from the words of a command line.

    Raises
    ------
    LoopError
        There are none.
    """
    name = " ".join(" ".join(words).split())
    if not name:
        raise LoopError('no effect is named: give one as the diagnosis writes it, e.g. stickslip add "mass at tip"')
    return name


def find_case(folder: Path) -> Path:
    """The one case of a folder, or the one that has a history.

    Raises
    ------
    LoopError
        There is none, or there are several.
    """
    cases = {file: case for file in sorted(folder.glob("*.toml")) if (case := _case(file)) is not None}
    # A finer one of another is no case of its own.
    finer = {(folder / name).resolve() for case in cases.values() for name in _refined(case)}
    found = [file for file in cases if file.resolve() not in finer]
    found = [file for file in found if cases[file]["schema"] == SCHEMA] or found
    if len(found) > 1:
        found = [file for file in found if history_of(file).steps] or found
    if len(found) == 1:
        return found[0]
    listed = ", ".join(file.name for file in found)
    raise LoopError(f"there is {listed or 'no case'} in {folder.resolve()}: name the case with --case")


def _diagnosed(case: Path, history: History, text: str, name: str, run: RunContext | None) -> dict[str, Any]:
    """What the last diagnosis would write."""
    key = case_key(text)
    told = next((each for each in reversed(history.steps) if each.what == DIAGNOSIS and each.case_key == key), None)
    if told is None:
        why = "the case was edited since its last diagnosis" if history.last_diagnosis else "it has no diagnosis"
        _checked(case, history, name, run)
        raise LoopError(
            f'{case}: {why}, from which to take the strength of "{name}": run stickslip diagnose, or give --value'
        )
    wanted = " ".join(name.split()).casefold()
    found = next((each for each in told.candidates if each["effect"].casefold() == wanted), None)
    if found is None:
        effect = _checked(case, history, name, run)
        raise LoopError(
            f'{case}: the last diagnosis did not fit "{effect}", as others explain the measurements far better: give '
            "its strength with --value"
        )
    # An effect that is there already is fitted with all others, and is no candidate.
    return {
        **{name: found[name] for name in ("effect", "values", "added", "calibrated")},
        "campaign": told.campaign,
        "before": told.before,
        "after": Errors.of(found["after"]),
        "drawn": told.drawn,
        "accepted": told.accepted,
    }


def _given(case: Path, history: History, name: str, texts: Sequence[str], run: RunContext | None) -> dict[str, Any]:
    """What the user says."""
    setup = _setup(case, history, run)
    effect = find_effect(case_catalogue(setup.model, setup.effects), name)
    if len(texts) != len(effect.parameters):
        listed = ", ".join(key_of(parameter) for parameter in effect.parameters)
        raise EffectError(f'"{effect.name}" has {len(effect.parameters)} values ({listed}), not {len(texts)}')
    values: dict[str, Written] = {}
    for text, parameter in zip(texts, effect.parameters, strict=True):
        try:
            value = value_of(text, parameter)
        except EffectError as error:
            raise EffectError(f'--value "{text}": {error}') from None
        values[key_of(parameter)] = Written(value=value if parameter.unit == "-" else " ".join(text.split()))
    noted: Mapping[str, list[Any]] = {key: [each.value, each.note] for key, each in values.items()}
    return {"effect": effect.name, "values": noted, "added": {}, "calibrated": {}}


def _checked(case: Path, history: History, name: str, run: RunContext | None) -> str:
    """The name of an effect of the case, as the catalogue writes it; one that is there already is refused."""
    setup = _setup(case, history, run)
    effect = find_effect(case_catalogue(setup.model, setup.effects), name)
    if effect.name in [each.effect.name for each in setup.added]:
        raise LoopError(
            f'{case}: "{effect.name}" is in the case already, and fitted in every diagnosis: change its value with '
            "--value"
        )
    return effect.name


def _setup(case: Path, history: History, run: RunContext | None) -> Setup:
    """The case, with the sensors of the campaign that it was diagnosed with if that is still there."""
    told = history.last_diagnosis
    campaign: Campaign | None = None
    if told is not None and (Path(told.campaign) / "campaign.toml").is_file():
        campaign = read_campaign(Path(told.campaign))
    return read_case(case, campaign, run).setup


def _saved(case: Path, history: History, step: Step, text: str) -> Step:
    """Write history and case, or neither."""
    longer = history.with_step(step)
    longer.save()
    try:
        write_beside(case, text)
    except InputError:
        history.save()
        raise
    return longer.steps[-1]


def _case(file: Path) -> dict[str, Any] | None:
    """What a file says; none if it is no case. One of an earlier form is named, so that it is refused with a remedy."""
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return None
    described = any(isinstance(data.get(table), dict) for table in ("structure", "model"))
    return data if "schema" in data and described else None


def _refined(case: dict[str, Any]) -> list[str]:
    table = case.get("numerical_error")
    names = table.get("refined") if isinstance(table, dict) else None
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


def _is_toml(text: str) -> bool:
    try:
        tomllib.loads(text.removeprefix("\ufeff"))
    except tomllib.TOMLDecodeError:
        return False
    return True
