"""Files that the result of a module's code depends on: its imports, their imports, and so on.

Imports are read from the source, also within functions: nothing is run, and no list of modules is kept by hand.
A module that makes a registry, or imports from a package itself and not from a module of it, may find members of the
package at run time: it depends on all modules of that package.
"""

import importlib.util
import sys
import sysconfig
from functools import cache
from pathlib import Path

from pipeline.source_facts import find_source_facts

#: The product's packages; they are followed wherever they are installed, unlike those of others.
PRODUCT = (
    "geometry", "fe", "reduction", "hbsolve", "transient", "correlation", "diagnosis", "casefile", "pipeline", "figure",
    "study",
)  # fmt: skip


@cache
def dependencies(module: str) -> dict[str, Path]:
    """Files that a module's code depends on, including its own.

    Parameters
    ----------
    module
        Import name; ``"__main__"`` is the running script.

    Returns
    -------
    File of each module by its import name: modules of the product, and others that are neither installed nor Python's.

    Raises
    ------
    TypeError
        The module has no file.
    """
    file = getattr(sys.modules.get(module), "__file__", None)
    start = Path(file) if file else _find_file(module)
    if start is None:
        raise TypeError(
            "a stage must be defined in a file: code that was typed in cannot be recognised on the next run"
        )
    files = {module: start}
    waiting = [start]
    while waiting:
        for name in _list_imports(waiting.pop()):
            if name not in files and (imported := _find_file(name)) is not None:
                files[name] = imported
                waiting.append(imported)
    return files


@cache
def _list_imports(file: Path) -> frozenset[str]:
    """Possible import names in the code of a file; some of them may not be modules."""
    facts = find_source_facts(file)
    names = set(facts.modules)
    for module, imported in facts.names:
        names.add(module)
        members = {f"{module}.{name}" for name in imported}
        names |= members
        if any(_find_file(member) is None for member in members):
            names.update(_list_below(module))
    names.update(name for package in facts.packages for name in _list_below(package))
    return frozenset(names)


@cache
def _list_below(package: str) -> frozenset[str]:
    """Import names of all modules below a package; empty for a module."""
    file = _find_file(package)
    if file is None or file.name != "__init__.py":
        return frozenset()
    members = (member.relative_to(file.parent).with_suffix("").parts for member in file.parent.rglob("*.py"))
    return frozenset(".".join((package, *(part for part in parts if part != "__init__"))) for parts in members)


@cache
def _find_file(module: str) -> Path | None:
    """Source file of a module whose code counts; None for a name that is no module, or belongs to another package."""
    package, _, name = module.rpartition(".")
    if not package:
        place = _find_top_level(module)
        return place / "__init__.py" if place and place.suffix != ".py" else place
    folder = _find_folder(package)
    if folder is None:
        return None
    # Listing a folder once is faster than testing each of its files and each name that is no file.
    if name in _list_content(folder) and "__init__.py" in _list_content(folder / name):
        return folder / name / "__init__.py"
    return folder / f"{name}.py" if f"{name}.py" in _list_content(folder) else None


@cache
def _find_folder(package: str) -> Path | None:
    """Folder of a package whose code counts, or None."""
    above, _, name = package.rpartition(".")
    if not above:
        return _find_top_level(package)
    folder = _find_folder(above)
    return folder / name if folder and name in _list_content(folder) else None


@cache
def _list_content(folder: Path) -> frozenset[str]:
    """Names of the content of a folder; empty if it is no folder."""
    try:
        return frozenset(entry.name for entry in folder.iterdir())
    except OSError:
        return frozenset()


@cache
def _find_top_level(name: str) -> Path | None:
    """Folder of a top-level package, or file of a top-level module, whose code counts."""
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return None
    if spec is None or not spec.has_location or not spec.origin:
        return None
    origin = Path(spec.origin)
    if name not in PRODUCT and any(origin.is_relative_to(folder) for folder in _list_installed()):
        return None
    return origin.parent if origin.name == "__init__.py" else origin


@cache
def _list_installed() -> tuple[Path, ...]:
    """Folders of Python's own modules and of the installed packages."""
    paths = sysconfig.get_paths()
    return tuple(Path(paths[name]) for name in ("stdlib", "platstdlib", "purelib", "platlib"))
