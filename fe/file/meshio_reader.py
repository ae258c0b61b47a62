"""meshio as a reader that cannot end the program: what it prints becomes a refusal."""

import contextlib
import io
import warnings
from pathlib import Path
from typing import Any

from fe.errors import MeshError

FORMATS = {"vtu": "VTK unstructured grid (.vtu)", "gmsh": "Gmsh mesh (.msh)"}


def import_meshio() -> Any:
    """Imported late, because it takes half a second and half the numerical work needs no file."""
    import meshio
    from meshio._common import num_nodes_per_cell
    from meshio._mesh import topological_dimension

    # Its table of dimensions lacks the serendipity wedge and pyramid, which it reads and writes otherwise.
    for cell_type in num_nodes_per_cell:
        if cell_type.startswith(("wedge", "pyramid")):
            topological_dimension.setdefault(cell_type, 3)
    return meshio


def read_with_meshio(path: Path, file_format: str) -> Any:
    """Read one file as meshio's own mesh.

    Parameters
    ----------
    path
        The file.
    file_format
        "vtu" or "gmsh": meshio's guess from ".msh" would be ANSYS.

    Raises
    ------
    MeshError
        The file cannot be read, or meshio warns that it left something out.
    """
    meshio = import_meshio()
    output = io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stderr(output), contextlib.redirect_stdout(output):
            # numpy only warns where a text file ends in the middle of its numbers.
            warnings.filterwarnings("error", message=".*string or file could not be read")
            result = getattr(meshio, file_format).read(str(path))
    # Damaged files raise anything from AssertionError to zlib.error, and some readers leave through SystemExit.
    except (Exception, SystemExit) as error:
        raise _make_reading_error(path, file_format, f"{type(error).__name__} {error}".strip()) from error
    if output.getvalue().strip():
        raise _make_reading_error(path, file_format, output.getvalue())
    return result


def _make_reading_error(path: Path, file_format: str, reason: str) -> MeshError:
    # One line, without the frames and colours of a terminal message.
    output = " ".join(reason.split())[:200].rstrip(" .:")
    return MeshError(
        f"mesh file {path} cannot be read as {FORMATS[file_format]} ({output}): "
        "it may be cut short or damaged, so write it again"
    )
