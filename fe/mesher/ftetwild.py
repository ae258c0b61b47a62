"""Fill a surface of triangles with tetrahedra by fTetWild, which keeps the surface within an envelope only."""

import importlib.util
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import TET10
from fe.errors import MeshError
from fe.mesher.block import Block, mesh_blocks
from geometry.errors import InputError

#: Program of a separate process: fTetWild writes a file to the working directory, and ends its process on bad input.
WORKER = """
import numpy, pytetwild
given = numpy.load("surface.npz")
sizes = {key: given[key] for key in ("bg_vertices", "bg_tets", "bg_values") if len(given[key])}
points, cells = pytetwild.tetrahedralize(
    given["points"], given["triangles"], edge_length_abs=float(given["size"]), epsilon=float(given["envelope"]),
    num_threads=1, quiet=True, **sizes,
)[:2]
numpy.savez("cells.npz", points=points, cells=cells)
"""
#: Python module of the mesher.
MODULE = "pytetwild"
#: Time limit [s]; the blade with cells of 2.5 mm takes two minutes.
TIME_LIMIT = 3600.0

Points = Float[NDArray[np.float64], "point 3"]


def fill_with_tetrahedra(
    points: Points,
    triangles: Int[NDArray[np.int64], "triangle 3"],
    *,
    size: float,
    envelope: float,
    sizes: tuple[Points, Int[NDArray[np.int64], "cell 4"], Float[NDArray[np.float64], " point"]],
) -> tuple[Points, Int[NDArray[np.int64], "cell 4"]]:
    """Fill a closed surface.

    The result is not reproducible: two runs give different meshes, so store the mesh that was used.

    Parameters
    ----------
    points, triangles
        Points [m] and triangles of the surface.
    size
        Length of edges where `sizes` gives none [m].
    envelope
        Largest distance between the given surface and the surface of the result [m].
    sizes
        Points, tetrahedra and lengths of edges at the points of a mesh around the body, see `make_size_field` [m].

    Returns
    -------
    Points [m], and the corners of tetrahedra of positive volume.

    Raises
    ------
    InputError
        pytetwild is not installed.
    MeshError
        fTetWild could not fill the surface, or exceeded the time limit.
    """
    if importlib.util.find_spec(MODULE) is None:
        raise InputError(
            'tetrahedra need pytetwild, which is not installed: sh install.sh, in a checkout pip install -e ".[tets]", '
            "or mesh with hexahedra"
        )
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    at, cells, values = sizes
    with tempfile.TemporaryDirectory(prefix="tetwild-") as folder:
        np.savez(
            Path(folder) / "surface.npz",
            points=points,
            triangles=triangles.astype(np.int32),
            size=size,
            envelope=envelope / diagonal,
            bg_vertices=at,
            bg_tets=cells.astype(np.int32),
            bg_values=values,
        )
        try:
            done = subprocess.run(
                [sys.executable, "-c", WORKER],
                cwd=folder,
                capture_output=True,
                text=True,
                timeout=TIME_LIMIT,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise MeshError(
                f"filling the solid with cells of {1e3 * size:g} mm took more than {TIME_LIMIT:g} s: give larger cells"
            ) from error
        archive = Path(folder) / "cells.npz"
        if not archive.is_file():
            output = " ".join(done.stderr.split())[-200:]
            raise MeshError(
                f"the solid could not be filled with tetrahedra (code {done.returncode}: {output}): check that it is "
                "closed, and give another element size"
            )
        with np.load(archive) as arrays:
            corners, tetrahedra = arrays["points"].astype(np.float64), arrays["cells"].astype(np.int64)
    if not len(tetrahedra):
        raise MeshError("the solid could not be filled with tetrahedra: check that it is closed")
    edges = corners[tetrahedra[:, 1:]] - corners[tetrahedra[:, :1]]
    mirrored = np.linalg.det(edges) < 0
    tetrahedra[mirrored] = tetrahedra[mirrored][:, [0, 2, 1, 3]]
    return corners, tetrahedra


def make_size_field(
    points: Points, spacing: float
) -> tuple[Float[NDArray[np.float64], "at 3"], Int[NDArray[np.int64], "cell 4"]]:
    """Coarse mesh of the box around a body; lengths of edges can be prescribed at its points [m]."""
    low, high = points.min(axis=0) - spacing, points.max(axis=0) + spacing
    counts = np.maximum(1, np.ceil((high - low) / spacing)).astype(int)
    box = Block.box([*zip(low, high, strict=True)], (int(counts[0]), int(counts[1]), int(counts[2])), {})
    mesh = mesh_blocks([box], TET10)
    used, cells = np.unique(mesh.cells[TET10.cell_type][:, :4], return_inverse=True)
    return mesh.points[used], cells.reshape(-1, 4)
