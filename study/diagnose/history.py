"""History of a case in ``CASE.history.json`` next to it: diagnoses, and effects that were added or removed."""

import hashlib
import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from math import isfinite, nan
from pathlib import Path
from typing import Any

from casefile.errors import CaseError, Problem
from geometry.errors import OutputError
from pipeline.output import replace_file

SCHEMA = 1
DIAGNOSIS, ADD, CALIBRATION, UNDO = "diagnosis", "add", "calibration", "undo"


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Errors of a model on the training and on the held-out data.

    Parameters
    ----------
    training, held_out
        Root mean square relative error of the fundamentals of motion [-]; NaN for data that are compared by features.
    training_chi2, held_out_chi2
        Reduced chi-squared [-]; 1 is noise.
    """

    training: float
    held_out: float
    training_chi2: float
    held_out_chi2: float

    @property
    def document(self) -> dict[str, float | None]:
        """JSON object; unknown errors are null."""
        return {name: value if isfinite(value) else None for name, value in vars(self).items()}

    @classmethod
    def read(cls, document: Mapping[str, float | None]) -> "Errors":
        """Errors from such an object."""
        return cls(**{name: nan if value is None else float(value) for name, value in document.items()})


@dataclass(frozen=True, kw_only=True)
class HistoryStep:
    """Step of a history.

    Parameters
    ----------
    what
        `DIAGNOSIS`, `ADD`, `CALIBRATION` or `UNDO`.
    when
        Local time, ISO 8601.
    case_key
        Hash of the case when it was diagnosed.
    campaign
        Folder of the campaign.
    effect
        Name of the effect that was added or removed; `CALIBRATION` if only values were fitted.
    values, calibrated
        Values of the effect and calibration factors as written into the case, each with half its 95 % interval.
    before, after
        Errors; None if unknown.
    drawn, accepted
        Errors of the nominal model of a diagnosis, and with calibration parameters alone; None if unknown.
    sentence, finding
        Verdict of a diagnosis.
    candidates
        Values that `add` would write for each fitted effect of a diagnosis.
    case_before, case_after
        The whole file.
    diff
        Changed lines.
    """

    what: str
    when: str = ""
    case_key: str = ""
    campaign: str = ""
    effect: str = ""
    values: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    calibrated: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    before: Errors | None = None
    after: Errors | None = None
    drawn: Errors | None = None
    accepted: Errors | None = None
    sentence: str = ""
    finding: str = ""
    candidates: Sequence[Mapping[str, Any]] = ()
    case_before: str = ""
    case_after: str = ""
    diff: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class History:
    """All steps of a case, oldest first.

    Parameters
    ----------
    file
        Path of the history.
    steps
        Steps in their order.
    """

    file: Path
    steps: tuple[HistoryStep, ...] = ()

    @property
    def active_steps(self) -> tuple[HistoryStep, ...]:
        """Added effects and calibrations that have not been undone."""
        steps: list[HistoryStep] = []
        for step in self.steps:
            if step.what in {ADD, CALIBRATION}:
                steps.append(step)
            elif step.what == UNDO and steps:
                steps.pop()
        return tuple(steps)

    @property
    def last_diagnosis(self) -> HistoryStep | None:
        """The latest diagnosis; None without any."""
        return next((step for step in reversed(self.steps) if step.what == DIAGNOSIS), None)

    def with_step(self, step: HistoryStep) -> "History":
        """The history with one more step; a diagnosis replaces a preceding one of the same case."""
        stamped = replace(step, when=step.when or datetime.now().astimezone().isoformat(timespec="seconds"))
        steps = self.steps
        if steps and step.what == steps[-1].what == DIAGNOSIS and step.case_key == steps[-1].case_key:
            steps = steps[:-1]
        return replace(self, steps=(*steps, stamped))

    def save(self) -> None:
        """Write the file.

        Raises
        ------
        OutputError
            It cannot be written.
        """
        steps = [_document_step(step) for step in self.steps]
        text = json.dumps({"schema": SCHEMA, "steps": steps}, indent=1, ensure_ascii=False, allow_nan=False)
        write_beside(self.file, f"{text}\n")


def name_history_file(case: Path) -> Path:
    """Path of the history of a case file."""
    return case.with_name(f"{case.stem}.history.json")


def history_of(case: Path) -> History:
    """The history of a case file; empty if it has none.

    Raises
    ------
    CaseError
        A history that is damaged.
    """
    file = name_history_file(case)
    if file.exists() and not file.is_file():
        raise _make_damage_error(file, "is a folder or a device")
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        if data["schema"] != SCHEMA:
            raise _make_damage_error(file, f"schema = {data['schema']} is of another version of stickslip")
        return History(file=file, steps=tuple(_step(item) for item in data["steps"]))
    except FileNotFoundError:
        return History(file=file)
    except OSError as error:
        raise _make_damage_error(file, f"cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise _make_damage_error(file, "is damaged") from None


def read_text(case: Path) -> str:
    """Text of a case file, with its line ends."""
    return case.read_bytes().decode("utf-8")


def hash_case(text: str) -> str:
    """Hash of the content of a case, independent of comments and layout."""
    data = tomllib.loads(text.removeprefix("\ufeff"))
    return hashlib.sha256(json.dumps(data, sort_keys=True, default=str).encode()).hexdigest()


def write_beside(file: Path, text: str) -> None:
    """Replace a file of the user.

    Raises
    ------
    OutputError
        Its folder or the file itself cannot be written.
    """
    try:
        if file.exists():
            file.open("ab").close()  # replacing the file would ignore its permissions
        replace_file(file, text.encode("utf-8"))
    except OSError as error:
        raise OutputError(
            f"{file} cannot be written ({error.strerror}): change its permissions, or work on a copy of the case"
        ) from None


def _document_step(step: HistoryStep) -> dict[str, Any]:
    data = {name: getattr(step, name) for name in step.__dataclass_fields__}
    errors = {name: item.document for name, item in data.items() if isinstance(item, Errors)}
    return {name: value for name, value in (data | errors).items() if value not in (None, "", (), {}, [])}


def _step(data: Mapping[str, Any]) -> HistoryStep:
    names = ("before", "after", "drawn", "accepted")
    return HistoryStep(**{**data, **{name: Errors.read(data[name]) for name in names if name in data}})


def _make_damage_error(file: Path, what: str) -> CaseError:
    text = f"{what}: correct it, or move it away to begin a new history"
    return CaseError([Problem(file=str(file), line=0, key="", text=text)])
