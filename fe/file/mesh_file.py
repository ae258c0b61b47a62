"""Read and write mesh files: VTK unstructured grid (.vtu), Abaqus and CalculiX deck (.inp), Gmsh mesh (.msh).

Nastran bulk data (.bdf, .nas) are read only.

Content of each format:

======  =============  ==========================  =========================  =======================
format  cell sets      face sets                   node sets                  fields at nodes
======  =============  ==========================  =========================  =======================
.vtu    yes            yes                         yes                        yes
.inp    ``*ELSET``     ``*SURFACE``                ``*NSET``                  no
.msh    phys. volumes  phys. surfaces              phys. points               written, not read
.bdf    properties     shells on solid elements    ``SET1``, ``SPC1``         no
======  =============  ==========================  =========================  =======================

No format keeps sets without members. Files contain no unit of length: the reader is given it. Files written here are in
metres.
"""

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_content import make_solid_mesh
from fe.file.registry import format_of, suffixes
from fe.mesh import Mesh
from fe.mesh_quality import check_quality


def read_mesh(path: str | PathLike[str], length_unit_in_metre: float = 1.0) -> Mesh:
    """Read the hexahedra and tetrahedra of a mesh file with their named sets.

    Named sets of surface cells become face sets where the cells lie on faces of solid cells, else node sets, as do
    named curves and points; these cells themselves, and nodes that no solid cell uses, are dropped. `Mesh.nodes` finds
    the nodes of either kind of set.

    Parameters
    ----------
    path
        File of one of the formats in `fe.file.mesh`, by its suffix: .vtu, .inp, .msh, .bdf, .nas.
    length_unit_in_metre
        Unit of the coordinates in the file [m]: 0.001 for a mesh in millimetres.

    Raises
    ------
    MeshError
        No such file, an unknown suffix, a damaged file, or cells that are not supported; one sentence with the remedy.
    InvertedCell
        Cells that are inverted, by set and by number: the file's own in .inp, counted from 0 otherwise.
    """
    file = Path(path)
    if not (np.isfinite(length_unit_in_metre) and length_unit_in_metre > 0):
        raise MeshError(f"length unit {length_unit_in_metre} m must be positive: 0.001 stands for millimetres")
    require_mesh_file(file)
    try:
        result = format_of(MESH_FORMATS, file).read(file)
    except OSError as error:
        raise make_opening_error(file, error) from error
    mesh, labels = make_solid_mesh(result, source=str(file), length_unit_in_metre=length_unit_in_metre)
    check_quality(mesh, source=file, labels=labels)
    return mesh


def require_mesh_file(file: Path) -> None:
    """Refuse a path that is not a mesh file, before it is opened.

    Raises
    ------
    MeshError
        An unknown suffix, or no file of that name.
    """
    _refuse_suffix(file, suffixes(MESH_FORMATS))
    if not file.is_file():
        raise MeshError(f"mesh file {file} does not exist: check its path")


def make_opening_error(file: Path, error: OSError) -> MeshError:
    """Error for a file, or a file that it includes, that the system cannot open."""
    named = f"{error.filename}: " if error.filename and Path(str(error.filename)) != file else ""
    return MeshError(f"mesh file {file} cannot be opened ({named}{error.strerror}): check that you may read it")


def write_mesh(
    mesh: Mesh,
    path: str | PathLike[str],
    point_data: Mapping[str, Float[NDArray[np.float64], "node ..."]] | None = None,
) -> None:
    """Write a mesh with its sets, in metres.

    Parameters
    ----------
    mesh
        The mesh.
    path
        File to write; its suffix gives the format: .vtu, .inp, .msh. An existing file is replaced.
    point_data
        Fields at the nodes by name, each (n_node,) or (n_node, 3).

    Raises
    ------
    MeshError
        An unknown suffix, a field or set name that the format cannot store, or a file that cannot be written.
    """
    file = Path(path)
    _refuse_suffix(file, suffixes(MESH_FORMATS, written=True))
    fields = {} if point_data is None else dict(point_data)
    for name, values in fields.items():
        if len(values) != mesh.n_node:
            raise MeshError(
                f'field "{name}" has {len(values)} rows, but the mesh has {mesh.n_node} nodes: give one each'
            )
    (write,) = (item.write for item in MESH_FORMATS if item.write and file.suffix.lower() in item.suffixes)
    try:
        write(mesh, file, fields)
    except OSError as error:
        raise MeshError(
            f"mesh file {file} cannot be written ({error.strerror}): choose an existing folder with write permission"
        ) from error


def _refuse_suffix(file: Path, known: Sequence[str]) -> None:
    if file.suffix.lower() not in known:
        raise MeshError(
            f'mesh file {file} has the suffix "{file.suffix}", which is unknown: use one of {", ".join(known)}'
        )
