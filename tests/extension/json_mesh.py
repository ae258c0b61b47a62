"""A mesh format from outside: points, cells and sets by name as JSON (.meshjson); fields are not carried."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_content import FileMesh
from fe.file.registry import FileFormat
from fe.mesh import Mesh

SETS = ("node_sets", "face_sets", "cell_sets")


def read(path: Path) -> FileMesh:
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
        return FileMesh(
            points=np.array(result["points"], dtype=np.float64).reshape(-1, 3),
            blocks=tuple((cell_type, np.array(nodes, dtype=np.int64)) for cell_type, nodes in result["cells"].items()),
            **{kind: {name: np.array(part, dtype=np.int64) for name, part in result[kind].items()} for kind in SETS},
        )
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise MeshError(f"mesh file {path} is no mesh in JSON, or cut short ({error}): write it again") from None


def write(mesh: Mesh, path: Path, point_data: dict[str, NDArray[np.float64]]) -> None:
    if point_data:
        raise MeshError(f"mesh file {path} carries no fields: write .vtu")
    content: dict[str, Any] = {"points": mesh.points.tolist()}
    for kind in ("cells", *SETS):
        content[kind] = {name: part.tolist() for name, part in getattr(mesh, kind).items()}
    path.write_text(json.dumps(content), encoding="utf-8")


MESH_FORMATS.register(
    FileFormat(
        name="json_mesh",
        suffixes=(".meshjson",),
        recognise=lambda head: head.lstrip()[:1] == b"{",
        read=read,
        write=write,
    )
)
