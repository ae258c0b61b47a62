"""File formats, found by suffix and content; their registries are in `fe.file.mesh` and `fe.file.matrix`."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeAlias, TypeVar

from geometry.registry import Registry

Content = TypeVar("Content")
Format: TypeAlias = "FileFormat[Any]"
#: Number of bytes at the beginning of a file that distinguish formats of the same suffix.
HEAD = 4096


@dataclass(frozen=True, kw_only=True)
class FileMaterial:
    """Elastic material from a mesh file, in the units of the file.

    Parameters
    ----------
    name
        Name of the material, or its number as text.
    young, poisson, density
        Young's modulus, Poisson's ratio and density; None where the file has no value.
    obstacle
        Reason why the material is not isotropic and elastic, such as "is orthotropic"; empty if it is.
    """

    name: str
    young: float | None = None
    poisson: float | None = None
    density: float | None = None
    obstacle: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class FileFormat(Generic[Content]):
    """File format.

    Parameters
    ----------
    name
        Short name ("gmsh").
    suffixes
        Suffixes of its files, lower case (".msh").
    recognise
        Function that returns whether the first `HEAD` bytes of a file are of this format; called where formats share a
        suffix.
    read
        Function that returns the content of a file: a `FileMesh` for a mesh format; for a matrix format each
        `FileMatrix` by its name, or a single one with the name "". A file that is damaged or of another kind raises an
        `InputError` with the remedy: a `MeshError` or a `MatrixFileError`.
    write
        For a mesh format, a function of `Mesh`, path and fields at the nodes by name, each (n_node, ...); None if the
        format is only read.
    materials
        For a mesh format, a function that returns the materials of the solid cells of a file; None if files contain
        no materials.
    """

    name: str
    suffixes: tuple[str, ...]
    recognise: Callable[[bytes], bool]
    read: Callable[[Path], Content]
    write: Callable[..., None] | None
    materials: Callable[[Path], tuple[FileMaterial, ...]] | None = None


def format_registry(what: str) -> Registry[Format]:
    """Registry of the "mesh" or "matrix" formats: the modules of the package `fe.file.mesh` or `fe.file.matrix`."""
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
    """Format of an existing file by its suffix; of several formats, the one that recognises the file."""
    result = [item for item in formats if file.suffix.lower() in item.suffixes]
    if len(result) > 1:
        with file.open("rb") as opened:
            head = opened.read(HEAD)
        result = [item for item in result if item.recognise(head)] or result
    return result[0]
