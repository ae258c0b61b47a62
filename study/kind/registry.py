"""Registry of case kinds, and reading of case files.

Each kind is a member of the registry, in a separate folder below `study.kind`. It defines the table ``[structure]``,
the function that makes the structure, and the functions of the commands. In place of a function that it does not have,
it gives a sentence with the reason, which the command prints.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any, cast

from pydantic import AfterValidator, ConfigDict, Field, create_model, model_validator

from casefile.errors import CaseError, Problem
from casefile.table import CaseModel, at_key, load_case, read_case_head
from casefile.validation import did_you_mean
from geometry.registry import Registry, load_plugin
from reduction.joint_law.registry import LAWS, Joint
from study.case.joint_table import make_joint_type
from study.case.structure import Structure
from study.case.tables import Case, PluginsTable, StructureTable
from study.case.trust import require_trust
from study.run_context import Answer, RunContext


@dataclass(frozen=True, kw_only=True)
class Extras:
    """Additions of a kind to the answer of `stickslip solve`.

    Parameters
    ----------
    files
        Written files.
    document
        Entries of the JSON document; the items of a list "curves" are added to the curves.
    text
        Lines above the table of curves.
    """

    files: tuple[Path, ...] = ()
    document: Mapping[str, Any] = field(default_factory=dict)
    text: str = ""


@dataclass(frozen=True, kw_only=True)
class CaseKind:
    """A kind of case.

    Parameters
    ----------
    name
        Value of the key ``kind`` in ``[structure]``.
    summary
        Description of the structure, after "a case of".
    table
        Model of ``[structure]``.
    structure
        Function that makes the structure; it may take minutes, in stages that are stored.
    reduce
        Function of `stickslip reduce` that writes files, with or without a check of the modes; or a sentence that says
        why there is no reduction.
    modes
        Function of `stickslip modes`, for a number of modes and the number of the filmed mode; None for a table of
        natural frequencies without pictures; or a sentence that says why there are no modes.
    solved
        Function that makes additions to the answer of `stickslip solve` from a `study.case.setup.ReadCase` and a
        `study.solve.run.SolveResult`; None for no additions.
    """

    name: str
    summary: str
    table: type[StructureTable]
    structure: "Callable[[OpenCase, RunContext], Structure]"
    reduce: "Callable[[OpenCase, RunContext, bool], Answer] | str"
    modes: "Callable[[OpenCase, RunContext, int, int | None], Answer] | str | None"
    solved: Callable[[Any, Any, RunContext], Extras] | None = None


CASE_KINDS: Registry[CaseKind] = Registry(
    "case kind",
    package="study.kind",
    group="stickslip.case_kinds",
    facts={
        "summary": "what such a structure is",
        "table": "the model of [structure]",
        "structure": "the function that makes the structure",
        "reduce": "what `stickslip reduce` does with it, or a sentence that says why nothing",
        "modes": "what `stickslip modes` does with it, None for a table, or a sentence that says why nothing",
    },
)


@dataclass(frozen=True, kw_only=True, eq=False)
class OpenCase:
    """Content of a case file.

    Parameters
    ----------
    path
        Path of the file.
    case
        Validated tables.
    kind
        Kind of its structure.
    """

    path: Path
    case: Case[Any]
    kind: CaseKind

    @property
    def folder(self) -> Path:
        """Folder to which file names in the case are relative."""
        return self.path.parent

    @property
    def title(self) -> str:
        """Title for tables and figures: that of the case, or the stem of the file name."""
        return self.case.title or self.path.stem

    def lacks(self, key: str, remedy: str) -> CaseError:
        """Make the error of a valid case that lacks a table for a command.

        Parameters
        ----------
        key
            Table that is missing, or of another type than the command needs.
        remedy
            Reason why the command needs the table, and an example.
        """
        if self.case.source is None:
            return CaseError([Problem(file=str(self.path), line=0, key=key, text=remedy)])
        return CaseError([replace(self.case.source.problem((key,), ""), text=remedy)])


def open_case(path: Path | str) -> OpenCase:
    """Read a case file.

    Raises
    ------
    CaseError
        If the case has mistakes; the error lists all of them with file and line.
    """
    path = Path(path)
    _load_plugins(path)
    head = read_case_head(path)
    structure = head.get("structure")
    name = structure.get("kind") if isinstance(structure, Mapping) else None
    if not isinstance(name, str) or name not in CASE_KINDS:
        load_case(path, _AnyCase)  # raises the error of the file
        raise AssertionError(f"{path}: the kind {name!r} was accepted")
    kind = CASE_KINDS[name]
    try:
        # Making the models of all joint laws takes longer than everything else here, so it is done only if needed.
        model = make_joint_case_model(kind.table, tuple(LAWS)) if "joint" in head else make_case_model(kind.table)
        return OpenCase(path=path, case=load_case(path, model), kind=kind)
    except CaseError:
        _refuse_kind(path, kind, set(cast(Mapping[str, Any], structure)))
        raise


def _refuse_kind(path: Path, kind: CaseKind, keys: set[str]) -> None:
    """Refuse a kind whose table lacks keys that ``[structure]`` has, if the table of another kind has all of them."""
    others = [f'"{other.name}"' for other in CASE_KINDS if keys <= set(other.table.model_fields)]
    foreign = sorted(keys - set(kind.table.model_fields))
    lacking = [name for name, info in kind.table.model_fields.items() if info.is_required() and name not in keys]
    misspelt = any(did_you_mean(key, [*kind.table.model_fields]) for key in foreign)
    if foreign and lacking and others and not misspelt:
        source = load_case(path, _AnyCase).source
        assert source is not None
        belong = "belongs" if len(foreign) == 1 else "belong"
        text = (
            f"{', '.join(foreign)} {belong} to kind = {' or '.join(others)}: give that kind, or the keys of "
            f"{kind.summary}"
        )
        raise CaseError([source.problem(("structure", "kind"), text)])


def make_case_model(table: type[StructureTable]) -> type[Case[Any]]:
    """Make the model of a case from the model of its ``[structure]``; joints are not validated."""
    return cast(type[Case[Any]], Case[table])  # type: ignore[valid-type]


@cache
def make_joint_case_model(table: type[StructureTable], laws: tuple[type[Joint], ...]) -> type[Case[Any]]:
    """Make the model of a case as `make_case_model`, with tables ``[[joint]]`` for the joint laws."""
    joints: Any = (tuple[make_joint_type(laws), ...], ())  # type: ignore[misc]
    model: Any = create_model("Case", __base__=make_case_model(table), joint=joints)
    return cast(type[Case[Any]], model)


def _load_plugins(path: Path) -> None:
    """Load the user's Python files that a case names, before its names are looked up in registries."""
    if "plugins" not in read_case_head(path):
        return
    case = load_case(path, _Plugins)
    for number, file in enumerate(case.plugins.files):
        with at_key(case, "plugins", "files", number):
            plugin = path.parent / file
            if plugin.is_file():
                require_trust([plugin], path)
            load_plugin(plugin)


class _Plugins(CaseModel):
    model_config = ConfigDict(extra="allow")

    plugins: PluginsTable


def _known(name: str) -> str:
    names = CASE_KINDS.names()
    if name not in names:
        *others, last = (f'"{item}"' for item in names)
        raise ValueError(f"must be {', '.join(others)} or {last}{did_you_mean(name, names)}")
    return name


class _AnyStructure(StructureTable):
    model_config = ConfigDict(extra="allow")

    kind: Annotated[str, AfterValidator(_known), Field(examples=["plain"])]


class _AnyCase(CaseModel):
    model_config = ConfigDict(extra="allow")

    structure: _AnyStructure

    @model_validator(mode="before")
    @classmethod
    def _described(cls, tables: dict[str, Any]) -> dict[str, Any]:
        if "structure" in tables:
            return tables
        if isinstance(tables.get("model"), list):
            raise ValueError(
                "this is the case of a mesh study: run it with `stickslip table1`, or describe one structure under "
                "[structure]"
            )
        near = next((key for key in tables if did_you_mean(key, ["structure"])), None)
        hint = f"; did you mean it by [{near}]?" if near else ""
        raise ValueError(f'table [structure] is missing; add it, with a kind such as "plain"{hint}')
