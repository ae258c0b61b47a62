"""Registries that find members of one kind: joint laws, elements, file formats, effects, figures.

Each member has its own file, which ends with ``REGISTRY.register(member)``. Registries find

- the product's own members by importing all modules of a package: one file per member, without a list;
- members of installed packages through an entry point of the group, which names a module;
- members in a user's file through `load`, or through `load_file` for members of any kind.

Nothing is imported before a member is requested. A member that lacks a fact, or whose name is in use, is refused when
it is registered. If a plug-in fails, the other members remain usable. A class from a user's file can be pickled:
another process that has imported this module finds the file by the name of the class's module.
"""

import importlib
import importlib.machinery
import importlib.util
import pkgutil
import re
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Generic, TypeVar

from geometry.errors import InputWarning, RegistryError

M = TypeVar("M")

#: Prefix of the module names of users' files; the rest is the path in hexadecimal digits.
PREFIX = "stickslip_outside_"
#: Python's message about a call with missing arguments.
MISSING = re.compile(r"(?P<called>\w+)(?:\.__init__)?\(\) missing \d+ required .*arguments?: (?P<names>.+)")
QUOTED = re.compile(r"'(.+?)'")

#: All existing registries; results depend on the files of their outside members.
REGISTRIES: "list[Registry[Any]]" = []


@dataclass(frozen=True, eq=False)
class Entry(Generic[M]):
    """Registered member with its position.

    Parameters
    ----------
    member
        Registered member.
    file, line
        File and line of the registration.
    """

    member: M
    file: str
    line: int

    @property
    def place(self) -> str:
        """File and line as text for messages."""
        return f"{self.file}, line {self.line}"

    @cached_property
    def path(self) -> Path:
        """Resolved path of the file; resolving accesses each of its folders."""
        return Path(self.file).resolve()


class Registry(Generic[M]):
    """Members of one kind by name.

    Parameters
    ----------
    kind
        Name of a member in the singular: "joint law".
    package
        Dotted name of the package with the product's own members.
    group
        Entry point group of installed packages; None if only the product itself can have members.
    key
        Attribute with the name of a member.
    facts
        Attributes that each member must define, with their descriptions; `key` is always one of them. None is a valid
        value; an abstract method is not.
    check
        Function that returns another problem of a member, as the end of a sentence with the remedy, or None.
    """

    def __init__(
        self,
        kind: str,
        *,
        package: str,
        group: str | None,
        key: str = "name",
        facts: Mapping[str, str] | None = None,
        check: Callable[[M], str | None] | None = None,
    ) -> None:
        self.kind, self.package, self.group, self.key = kind, package, group, key
        REGISTRIES.append(self)
        self.facts = {key: "what it is called", **(facts or {})}
        self._check = check
        self._entries: dict[str, Entry[M]] = {}
        self._complete = False
        self._failures: list[str] = []

    def register(self, member: M, *, depth: int = 1) -> M:
        """Register a member and return it, so that this also serves as a decorator.

        Parameters
        ----------
        member
            Member to register.
        depth
            Number of calls between this function and the declaration, whose line messages name [-].

        Raises
        ------
        RegistryError
            The member lacks a fact, its name is in use, or a fact is wrong; the message has file, line and remedy.
        """
        frame = sys._getframe(depth)
        entry = Entry(member, frame.f_code.co_filename, frame.f_lineno)
        lacking = [fact for fact in self.facts if not _given(member, fact)]
        name: object = getattr(member, self.key, None)
        if not self._is_own(entry):
            self._discover()  # names of the product's own members are reserved
        if lacking:
            called = name if isinstance(name, str) else getattr(member, "__name__", type(member).__name__)
            wanted = ", ".join(f"{fact} ({self.facts[fact]})" for fact in lacking)
            raise RegistryError(f'{entry.place}: the {self.kind} "{called}" lacks {wanted}: add it')
        if not isinstance(name, str) or not name.strip():
            raise RegistryError(f"{entry.place}: the {self.key} of a {self.kind} is {name!r}: give it one as text")
        taken = self._entries.get(name)
        if taken is not None:
            raise RegistryError(
                f'{entry.place}: a {self.kind} "{name}" is already registered in {taken.place}: give it another name'
            )
        if self.group is None and not self._is_own(entry):
            raise RegistryError(
                f'{entry.place}: the {self.kind} "{name}" is not in {self.package}, but only files of that package '
                "can register one: move it there"
            )
        wrong = self._check(member) if self._check else None
        if wrong:
            raise RegistryError(f'{entry.place}: the {self.kind} "{name}" {wrong}')
        self._entries[name] = entry
        return member

    def __getitem__(self, name: str) -> M:
        """Member by its name.

        Raises
        ------
        RegistryError
            An unknown name; the message lists the known ones.
        """
        if name not in self:
            failed = "".join(f"; {failure}" for failure in self._failures)
            raise RegistryError(f'there is no {self.kind} "{name}": choose {", ".join(sorted(self._entries))}{failed}')
        return self._entries[name].member

    def __contains__(self, name: object) -> bool:
        if name not in self._entries:
            self._import_namesake(name)
        if name not in self._entries:
            self._discover()
        return name in self._entries

    def __iter__(self) -> Iterator[M]:
        return iter([self._entries[name].member for name in self.names()])

    def __len__(self) -> int:
        return len(self.names())

    def names(self) -> list[str]:
        """Names of all members, sorted, so that they are equal in every process."""
        self._discover()
        return sorted(self._entries)

    def entry(self, name: str) -> Entry[M]:
        """Member with the position where it was registered."""
        self[name]
        return self._entries[name]

    @property
    def failures(self) -> tuple[str, ...]:
        """Messages about installed plug-ins that could not be loaded, one sentence each."""
        self._discover()
        return tuple(self._failures)

    def load(self, path: str | Path) -> tuple[M, ...]:
        """Load the members of this kind from a user's Python file; a file is executed once per process.

        Raises
        ------
        RegistryError
            A file that is missing, fails, or registers no member of this kind.
        """
        file = load_file(path, self.kind)
        members = tuple(entry.member for entry in self._entries.values() if entry.file == str(file))
        if not members:
            raise RegistryError(
                f"{file}: this file registers no {self.kind}: end it with a call of `register` of the registry of "
                f"{self.kind}s"
            )
        return members

    def forget(self, path: str | Path) -> None:
        """Undo `load`: remove the members of a user's file, so that the file is executed again when it is loaded."""
        file = str(Path(path).expanduser().resolve())
        self._entries = {name: entry for name, entry in self._entries.items() if entry.file != file}
        sys.modules.pop(module_name(Path(file)), None)

    def outside_files(self) -> list[Path]:
        """Files of registered members from outside the product, sorted; stored results also depend on them."""
        files = {entry.path for entry in self._entries.values() if not self._is_own(entry)}
        return sorted(file for file in files if file.is_file())

    def _is_own(self, entry: Entry[M]) -> bool:
        return any(entry.path.is_relative_to(folder) for folder in self._folders)

    @cached_property
    def _folders(self) -> tuple[Path, ...]:
        """Folders of the product's own members."""
        return tuple(Path(folder).resolve() for folder in importlib.import_module(self.package).__path__)

    def _import_namesake(self, name: object) -> None:
        """Import the product's file with the name of a member, so that no other file need be imported."""
        if isinstance(name, str) and name.isidentifier() and not self._complete:
            module = f"{self.package}.{name}"
            if importlib.util.find_spec(module) is not None:
                importlib.import_module(module)

    def _discover(self) -> None:
        """Import the product's own members and those of installed packages, once."""
        if self._complete:
            return
        self._complete = True  # Members may ask their registry while they are imported.
        try:
            package = importlib.import_module(self.package)
            for module in pkgutil.iter_modules(package.__path__, f"{self.package}."):
                importlib.import_module(module.name)
        except BaseException:
            self._complete = False
            raise
        for point in installed_points(self.group) if self.group else ():
            try:
                _attempt(point.load, f'entry point "{point.name} = {point.value}" of {self.group}')
            except RegistryError as failure:
                self._failures.append(str(failure))
                warnings.warn(f"a {self.kind} is not used: {failure}", InputWarning, stacklevel=3)


def installed_points(group: str) -> tuple[EntryPoint, ...]:
    """Entry points of a group, of all installed packages."""
    return tuple(_all_points().select(group=group))


@cache
def _all_points() -> Any:
    """Entry points of all groups; the metadata of packages are read once for all registries."""
    return entry_points()


def load_file(path: str | Path, what: str = "registered extension") -> Path:
    """Import a user's Python file that registers members of any kind; a file is executed once per process.

    Parameters
    ----------
    path
        Path of the file.
    what
        Name for messages of the members that it should register.

    Returns
    -------
    Resolved path of the file.

    Raises
    ------
    RegistryError
        A file that is missing or fails; in that case none of its members is kept.
    """
    file = Path(path).expanduser().resolve()
    if not file.is_file():
        raise RegistryError(f"{path}: there is no such file: give the path of a Python file with a {what}")
    _attempt(lambda: importlib.import_module(module_name(file)), str(file))
    return file


def load_plugin(path: str | Path) -> None:
    """Load a file that must register at least one member, see `load_file`.

    Raises
    ------
    RegistryError
        As in `load_file`, or a file that registers no member.
    """
    file = load_file(path)
    if not any(entry.file == str(file) for registry in REGISTRIES for entry in registry._entries.values()):
        raise RegistryError(f"{file}: this file registers nothing: end it with a call of `register` of a registry")


def loaded_files() -> list[Path]:
    """Users' files that this process has loaded, sorted; child processes need them too."""
    names = [name for name in sys.modules if name.startswith(PREFIX)]
    return sorted(Path(bytes.fromhex(name.removeprefix(PREFIX)).decode()) for name in names)


def _attempt(load: Callable[[], object], origin: str) -> None:
    """Import external code; if it fails, none of its members is kept, and the error is one sentence."""
    before = {registry: {*registry._entries} for registry in REGISTRIES}
    try:
        load()
    except (Exception, SystemExit) as error:
        for registry in REGISTRIES:
            stay = before.get(registry, set())
            # The product's own members may have been registered meanwhile.
            registry._entries = {
                name: entry for name, entry in registry._entries.items() if name in stay or registry._is_own(entry)
            }
        if isinstance(error, RegistryError) and ", line " in str(error):
            raise
        packages = {"geometry", *(registry.package.partition(".")[0] for registry in REGISTRIES)}
        ours = tuple(sys.modules[name].__path__[0] for name in sorted(packages) if name in sys.modules)
        raise RegistryError(_sentence(error, origin, ours)) from error


def _given(member: object, fact: str) -> bool:
    return hasattr(member, fact) and not getattr(getattr(member, fact), "__isabstractmethod__", False)


def module_name(file: Path) -> str:
    """Module name of a user's file, by which any process can find the file."""
    return PREFIX + str(file).encode().hex()


def _sentence(error: BaseException, origin: str, ours: tuple[str, ...]) -> str:
    """Message about an error in a plug-in, with its position: the last line outside the product."""
    steps = [step for step in traceback.extract_tb(error.__traceback__) if not step.filename.startswith(ours)]
    theirs = [step for step in steps if "importlib" not in step.filename]
    place = f"{theirs[-1].filename}, line {theirs[-1].lineno}" if theirs else origin
    if isinstance(error, SyntaxError) and error.filename:
        place = f"{error.filename}, line {error.lineno}"
    message = error.msg if isinstance(error, SyntaxError) else str(error)
    what = " ".join(message.split()) or "no message"
    if isinstance(error, RegistryError):
        return f"{place}: {what}"
    if isinstance(error, TypeError) and (missing := MISSING.search(what)):
        return f"{place}: {_lacks(missing['called'], QUOTED.findall(missing['names']))}"
    named = "" if origin in place else f" ({origin})"
    return f"{place}: {type(error).__name__}: {what}{named}: correct the file, or do not use it"


def _lacks(called: str, names: Sequence[str]) -> str:
    """Message about missing arguments of a call, with descriptions of those that are facts of a member."""
    facts = {fact: meaning for registry in REGISTRIES for fact, meaning in registry.facts.items()}
    wanted = ", ".join(f"{name} ({facts[name]})" if name in facts else name for name in names)
    return f"{called} lacks {wanted}: add it"


class _FileFinder:
    """Finder of the modules of users' files by their names."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Module specification of the file whose path is in the name."""
        del path, target
        if not name.startswith(PREFIX):
            return None
        file = bytes.fromhex(name.removeprefix(PREFIX)).decode()
        loader = importlib.machinery.SourceFileLoader(name, file)
        return importlib.util.spec_from_file_location(name, file, loader=loader)


if not any(type(finder).__name__ == _FileFinder.__name__ for finder in sys.meta_path):
    sys.meta_path.append(_FileFinder())
