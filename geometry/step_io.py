"""Write parts to STEP files in millimetres, with names of faces, and check that STEP files are complete."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

from geometry.errors import InputError
from geometry.part import Part

# A CadQuery assembly; the actual type would import CadQuery with this module.
Assembly: TypeAlias = Any

FIRST_WORD, LAST_WORD = b"ISO-10303-21;", b"END-ISO-10303-21;"


def write_step(part: Part, path: Path) -> None:
    """Write a part to a STEP file in millimetres, completely or not at all.

    Each named face has its name in the file, which CAD systems read as the name of the ADVANCED_FACE; points and
    contact lines are not in the file. An existing file is replaced only when the new one is complete.

    Parameters
    ----------
    part
        The part; its solid is not changed.
    path
        File to write; missing folders are created.

    Raises
    ------
    InputError
        The folder or the file cannot be written.
    """
    _write(_with_face_names(part), path)


def write_assembly_step(name: str, parts: Mapping[str, Part], path: Path) -> None:
    """Write several parts to one STEP file, as `write_step` does: an assembly with named components.

    Parameters
    ----------
    name
        Name of the assembly.
    parts
        Placed parts by the names of the components.
    path
        File to write.

    Raises
    ------
    InputError
        The folder or the file cannot be written.
    """
    import cadquery as cq

    assembly = cq.Assembly(name=name)
    for component, part in parts.items():
        assembly.add(_with_face_names(part), name=component)
    _write(assembly, path)


def _with_face_names(part: Part) -> Assembly:
    import cadquery as cq

    assembly = cq.Assembly(part.solid, name=part.name)
    for name, region in part.faces.items():
        for face in region.faces:
            assembly.addSubshape(face, name=name)
    return assembly


def _write(assembly: Assembly, path: Path) -> None:
    from cadquery.occ_impl.exporters.assembly import exportAssembly

    path = Path(path)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # The kernel reports only whether it could write; opening the file first gives the reason.
        partial.touch()
        if not exportAssembly(assembly, str(partial)):
            raise InputError(f"the STEP file {path} could not be written: free some disk space")
        partial.replace(path)
    except OSError as error:
        raise InputError(
            f"the STEP file {path} cannot be written ({error.strerror}): give a path in a folder that you may write to"
        ) from error
    finally:
        if partial.exists():
            partial.unlink()


def check_complete(path: Path) -> None:
    """Refuse a file that is not a complete STEP file.

    Raises
    ------
    InputError
        The file cannot be read, or does not begin and end as STEP files do.
    """
    if path.exists() and not path.is_file():
        raise InputError(f"the STEP file {path} is a folder or a device: name a file")
    try:
        text = path.read_bytes()
    except OSError as error:
        raise InputError(f"the STEP file {path} cannot be read ({error.strerror}): check the path") from error
    # The kernel prints its errors to the terminal; this check avoids those about incomplete files.
    first, last = FIRST_WORD.decode(), LAST_WORD.decode()
    if not text.strip():
        raise InputError(f"{path} is empty: export or copy it again")
    if not text.lstrip().startswith(FIRST_WORD):
        raise InputError(
            f'{path} is not a STEP file, which begins with "{first}": name one exported by the CAD program'
        )
    if not text.rstrip().endswith(LAST_WORD):
        raise InputError(f'{path} is not a complete STEP file, which ends in "{last}": export or copy it again')
