r"""Case files: TOML with units in the values, all mistakes reported at once with file and line.

A case is a pydantic model that derives from `CaseModel`; its quantities are the types of `casefile.quantity`::

    class BladeCase(CaseModel):
        length: Annotated[Length, Field(gt=0)]
        thickness: Annotated[Length, Field(gt=0)] = 0.01004     # defaults are in SI

    class MeshCase(CaseModel):
        element: Literal["hex8", "hex20"]
        elements_through_thickness: Count = 4

    class Table1Case(CaseModel):
        blade: BladeCase
        mesh: list[MeshCase] = []

    case = load_case(path, Table1Case)
    with located(case, "blade"):                                 # a GeometryError now shows file and line
        blade = Blade(length=case.blade.length, thickness=case.blade.thickness)

and the file, whose first line is the version of its form::

    schema = 2
    [blade]
    length = "250 mm"
    [[mesh]]
    element = "hex20"

A mistake reads ``my.toml:3: blade.length = "250 kg": "kg" makes it a mass, but a length is needed, e.g. "250 mm"``.
`load_case` itself checks ``schema``; models do not declare it. The models know nothing of files: they can be built and
validated in code as well.
"""

import tomllib
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, PrivateAttr, ValidationError

from casefile import validation
from casefile.errors import CaseError, Problem
from casefile.source import CaseSource, find_key_in_message, find_value
from geometry.errors import InputError, InputWarning
from geometry.toml_position import explain_syntax, key_lines

SCHEMA = 2
#: What was schema 1 is written anew by hand: its tables have moved.
FROM_SCHEMA_1 = (
    'write "schema = 2", put what describes the structure under [structure] with its kind, call [[contact]] [[joint]] '
    "and [[output]] [[sensor]], and move harmonics and samples from [sweep] to [harmonics] (docs/case.md)"
)


class CaseModel(BaseModel):
    """A table of a case file: unknown keys are refused, values cannot be changed afterwards."""

    # Only the table of a whole file is validated by itself: it makes what its tables need.
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    _source: CaseSource | None = PrivateAttr(default=None)

    @property
    def source(self) -> CaseSource | None:
        """Where `load_case` found it; None for a case built in code and for tables within a case."""
        return self._source


Case = TypeVar("Case", bound=CaseModel)


def load_case(path: str | Path, model: type[Case]) -> Case:
    """Read and validate a case file.

    Parameters
    ----------
    path
        A TOML file whose first key is ``schema = 2``.
    model
        Model of the file's content.

    Returns
    -------
    The validated case; it remembers where its values stand, for `located`.

    Warns
    -----
    InputWarning
        A value that is possible but unusual in its place.

    Raises
    ------
    CaseError
        With every problem of the file at once.
    """
    source = _read(path)
    problems = _find_schema_problems(source)
    if problems and "schema" in source.data:
        raise CaseError(problems)  # Another version: its other keys may be right in their own way.
    values = {key: value for key, value in source.data.items() if key != "schema"}
    try:
        case = model.model_validate(values)
    except ValidationError as error:
        problems += validation.problems(error, model, source)
        raise CaseError(problems) from None
    if problems:
        raise CaseError(problems)
    case._source = source
    for doubt in validation.doubts(case, source):
        warnings.warn(str(doubt), InputWarning, stacklevel=2)
    return case


def located(case: CaseModel, *table: str | int, keys: Mapping[str, str] | None = None) -> AbstractContextManager[None]:
    """Give an `InputError` of the numerical packages the file and line that it comes from.

    The key is the one that the message speaks of, be it "root height" or "root_height"; if there is none, the table is
    named.

    Parameters
    ----------
    case
        The case as `load_case` returned it.
    table
        Path of the table that the values came from, e.g. ``"blade"`` or ``"mesh", 2``.
    keys
        Case key by parameter name, where they differ.

    Raises
    ------
    CaseError
        In place of any other `InputError` raised within.
    """

    def problem(source: CaseSource, message: str) -> Problem:
        key = find_key_in_message(message, find_value(source.data, table), keys or {})
        path = table if key is None else (*table, key)
        return source.problem(path, message, show_value=key is not None)

    return _located(case, problem)


def at_key(case: CaseModel, *path: str | int) -> AbstractContextManager[None]:
    """As `located`, of a mistake that belongs to one key, whatever its message speaks of; its value is written too.

    Raises
    ------
    CaseError
        In place of any other `InputError` raised within.
    """
    return _located(case, lambda source, message: source.problem(path, message))


@contextmanager
def _located(case: CaseModel, problem: Callable[[CaseSource, str], Problem]) -> Iterator[None]:
    try:
        yield
    except CaseError:
        raise
    except InputError as error:
        if case.source is None:
            raise
        raise CaseError([problem(case.source, str(error))]) from error


def _read(path: str | Path) -> CaseSource:
    file = str(path)

    def refuse(text: str, line: int = 0) -> CaseError:
        return CaseError([Problem(file=file, line=line, key="", text=text)])

    if Path(path).exists() and not (Path(path).is_file() or Path(path).is_dir()):
        raise refuse("this is a device; name a case file, a TOML text")
    try:
        raw = Path(path).read_bytes()
    except FileNotFoundError:
        raise refuse("there is no such case file; check the spelling and the folder") from None
    except IsADirectoryError:
        raise refuse("this is a folder; name the .toml file in it") from None
    except OSError as error:
        raise refuse(f"cannot be read ({error.strerror}); check its permissions") from None
    if b"\0" in raw:
        raise refuse("this is a binary file; name a case file, a TOML text")
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError as error:
        byte = f"byte 0x{raw[error.start]:02x} is not UTF-8"
        raise refuse(f"{byte}; save the file as UTF-8", raw.count(b"\n", 0, error.start) + 1) from None
    # Editors that save a byte-order mark mean the same file.
    text = text.removeprefix("\ufeff")
    try:
        data = tomllib.loads(text)
        lines = key_lines(text)
    except tomllib.TOMLDecodeError as error:
        message, line = explain_syntax(str(error), text)
        raise refuse(message, line) from None
    except ValueError:  # Python's own limit
        raise refuse("it has a number with thousands of digits: shorten it") from None
    except RecursionError:
        raise refuse("its brackets are nested too deeply") from None
    return CaseSource(file=file, text=text, data=data, lines=lines)


def _find_schema_problems(source: CaseSource) -> list[Problem]:
    wanted = f"schema = {SCHEMA}"
    if "schema" not in source.data:
        return [source.problem((), f'schema is missing; write "{wanted}" as the first line')]
    result = source.data["schema"]
    if result == SCHEMA and type(result) is int:
        return []
    if result == 1 and type(result) is int:
        return [source.problem(("schema",), f"this earlier format of case files is no longer read: {FROM_SCHEMA_1}")]
    remedy = f'this version of stickslip reads "{wanted}"'
    if type(result) is int and result > SCHEMA:
        remedy = f"a later format of case files; {remedy}: install a later stickslip, or rewrite the file"
        return [source.problem(("schema",), remedy)]
    return [source.problem(("schema",), f"unknown format of case files; {remedy}")]


@dataclass
class Mistakes:
    """Collects the problems of a case.

    Parameters
    ----------
    case
        As `casefile.table.load_case` returned it.
    problems
        Found ones.
    """

    case: CaseModel
    problems: list[Problem] = field(default_factory=list)

    @contextmanager
    def at(self, *table: str | int) -> Iterator[None]:
        """Note what goes wrong within, with file and line, and go on behind it."""
        try:
            with located(self.case, *table):
                yield
        except CaseError as error:
            self.problems += error.problems

    def raise_if_any(self) -> None:
        """Raise a `CaseError` with all of them."""
        if self.problems:
            raise CaseError(list(dict.fromkeys(self.problems)))


def read_case_head(path: Path) -> dict[str, Any]:
    """Contents of a case file; empty if it cannot be read, of which `casefile.table.load_case` gives the reason."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8").removeprefix("\ufeff")) if path.is_file() else {}
    except (OSError, ValueError, RecursionError):
        return {}


def refuse_other_case(path: Path, what: str, remedy: str) -> CaseError:
    """The refusal of a whole file.

    Parameters
    ----------
    path
        The case file.
    what
        Content of the case, with its article.
    remedy
        Remedy, in the imperative.
    """
    return CaseError([Problem(file=str(path), line=0, key="", text=f"this is the case of {what}: {remedy}")])
