"""Read files with meshio; its messages and its attempts to exit the program become a `MeshError`."""

import contextlib
import io
import warnings
from pathlib import Path
from typing import Any

from fe.errors import MeshError

FORMATS = {"vtu": "VTK unstructured grid (.vtu)", "gmsh": "Gmsh mesh (.msh)"}


def import_meshio() -> Any:
    """Import meshio only when it is needed, because the import takes half a second."""
    import meshio
    from meshio._common import num_nodes_per_cell
    from meshio._mesh import topological_dimension

    # meshio reads and writes the serendipity wedge and pyramid, but its table of dimensions lacks them.
    for cell_type in num_nodes_per_cell:
        if cell_type.startswith(("wedge", "pyramid")):
            topological_dimension.setdefault(cell_type, 3)
    return meshio


def read_with_meshio(path: Path, file_format: str) -> Any:
    """Read one file as a meshio mesh.

    Parameters
    ----------
    path
        The file.
    file_format
        Format: "vtu" or "gmsh"; meshio would read ".msh" as a file of ANSYS.

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
    # Damaged files raise anything from AssertionError to zlib.error, and some readers raise SystemExit.
    except (Exception, SystemExit) as error:
        raise _make_reading_error(path, file_format, f"{type(error).__name__} {error}".strip()) from error
    if output.getvalue().strip():
        raise _make_reading_error(path, file_format, output.getvalue())
    return result


def _make_reading_error(path: Path, file_format: str, reason: str) -> MeshError:
    # One line: meshio's message is formatted for a terminal.
    output = " ".join(reason.split())[:200].rstrip(" .:")
    return MeshError(
        f"mesh file {path} cannot be read as {FORMATS[file_format]} ({output}): "
        "it may be cut short or damaged, so write it again"
    )
