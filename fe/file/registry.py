"""File formats, found by suffix and content; their registries are in their packages."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

from geometry.registry import Registry

Content = TypeVar("Content")
Format: TypeAlias = "FileFormat[Any]"
#: Bytes from the beginning of a file by which formats of one suffix are told apart.
HEAD = 4096


@dataclass(frozen=True, kw_only=True)
class FileMaterial:
    """An elastic material as a mesh file gives it, in the file's own units.

    Parameters
    ----------
    name
        Its name, or its number as text.
    young, poisson, density
        None where the file does not say.
    obstacle
        Why it is no isotropic elastic material, such as "is orthotropic"; empty if it is one.
    """

    name: str
    young: float | None = None
    poisson: float | None = None
    density: float | None = None
    obstacle: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class FileFormat(Generic[Content]):
    """One format of files.

    Parameters
    ----------
    name
        Short name ("gmsh").
    suffixes
        Endings of its files, lower case (".msh").
    recognise
        Whether the first `HEAD` bytes of a file are those of this format; asked where formats share a suffix.
    read
        Content of a file. A mesh format gives a `FileMesh`; a matrix format the `FileMatrix` of each name, or one of
        the name "". A file that is damaged, or of another kind, is an `InputError` with the remedy: a `MeshError` or a
        `MatrixFileError`.
    write
        For a mesh format, a function of `Mesh`, path and fields at the nodes by name, each (n_node, ...); None where
        the format is only read.
    materials
        For a mesh format, the materials of the solid cells of a file; None where files carry none.
    """

    name: str
    suffixes: tuple[str, ...]
    recognise: Callable[[bytes], bool]
    read: Callable[[Path], Content]
    write: Callable[..., None] | None
    materials: Callable[[Path], tuple[FileMaterial, ...]] | None = None


def format_registry(what: str) -> Registry[Format]:
    """Formats of what is "mesh" or "matrix": the modules of the package `fe.file.mesh` or `fe.file.matrix`."""
    registry: Registry[Format]

    def wrong(given: Format) -> str | None:
        if not given.suffixes or any(suffix != suffix.lower() or suffix[:1] != "." for suffix in given.suffixes):
            return f"has the suffixes {given.suffixes}: give lower-case ones with their dot"
        for other in registry:
            shared = {*given.suffixes} & {*other.suffixes}
            if shared and given.write and other.write:
                return f'writes {sorted(shared)[0]} files, as "{other.name}" does: give it a different suffix'
        return None

    registry = Registry(
        f"{what} format",
        package=f"fe.file.{what}",
        group=f"stickslip.{what}_formats",
        facts=dict.fromkeys(FileFormat.__dataclass_fields__, "see `fe.file.registry.FileFormat`"),
        check=wrong,
    )
    return registry


def suffixes(formats: Registry[FileFormat[Content]], *, written: bool = False) -> list[str]:
    """Suffixes of all formats, or of those that are written, sorted."""
    return sorted({suffix for item in formats if item.write or not written for suffix in item.suffixes})


def format_of(formats: Registry[FileFormat[Content]], file: Path) -> FileFormat[Content]:
    """The format of an existing file whose suffix is one of `suffixes`: of several, the one that recognises it."""
    result = [item for item in formats if file.suffix.lower() in item.suffixes]
    if len(result) > 1:
        with file.open("rb") as opened:
            head = opened.read(HEAD)
        result = [item for item in result if item.recognise(head)] or result
    return result[0]
