"""Picture of a solid whose faces have numbers, so that one can be named."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from figure.scene.film import check_suffix
from figure.scene.off_screen import load_pyvista_off_screen

#: Corners [m] and triangles of a face.
Surface = tuple[Float[NDArray[np.float64], "corner 3"], Int[NDArray[np.int64], "triangle 3"]]
#: Pale, so that numbers are read on all of them; colour-blind readers tell neighbours by the edges.
COLOURS = ("#9ecae1", "#fdd0a2", "#c7e9c0", "#dadaeb", "#fdae6b", "#bdbdbd", "#e7cb94", "#a1d9d4")
SIZE = (1400, 800)
#: How numbers look.
LABEL = {
    "shape": "rounded_rect", "shape_color": "white", "font_size": 20, "text_color": "#101820", "point_size": 1,
    "margin": 3,
}  # fmt: skip
#: Larger than the view that pyvista chooses, which leaves broad margins [-].
ZOOM = 1.1
#: From the solid towards the eye, of both halves of the picture.
VIEWS = ((0.8, -0.62, 0.36), (-0.8, 0.62, -0.36))


def save_numbered_faces(surfaces: Sequence[Surface], path: str | PathLike[str], *, title: str) -> Path:
    """Draw the faces from both sides, each with its number, counted from 1.

    Parameters
    ----------
    surfaces
        The faces.
    path
        PNG file.
    title
        Words above.

    Raises
    ------
    MissingSoftware
        No picture can be drawn on this machine.
    """
    file = check_suffix(path, (".png",))
    pyvista = load_pyvista_off_screen()
    plotter = pyvista.Plotter(off_screen=True, window_size=SIZE, shape=(1, 2), border=False)
    meshes = [pyvista.PolyData(corners, np.insert(triangles, 0, 3, axis=1).ravel()) for corners, triangles in surfaces]
    for half, towards_eye in enumerate(VIEWS):
        plotter.subplot(0, half)
        for number, mesh in enumerate(meshes):
            plotter.add_mesh(mesh, color=COLOURS[number % len(COLOURS)], ambient=0.3)
            edges = mesh.extract_feature_edges(boundary_edges=True, feature_edges=False, manifold_edges=False)
            if edges.n_points:  # a sphere has none
                plotter.add_mesh(edges, color="#101820", line_width=1.5)
        centres = np.array([mesh.cell_centers().points[_find_largest(mesh)] for mesh in meshes])
        seen = [k for k, mesh in enumerate(meshes) if _faces_eye(mesh, towards_eye)]
        if seen:
            numbers = [str(k + 1) for k in seen]
            plotter.add_point_labels(centres[seen], numbers, always_visible=True, **LABEL)
        if half == 0:
            plotter.add_text(title, font_size=12, color="#101820")
        plotter.view_vector(towards_eye, viewup=(0, 0, 1))
        plotter.enable_parallel_projection()
        plotter.camera.zoom(ZOOM)
    plotter.set_background("white")
    plotter.screenshot(str(file))
    plotter.close()
    return file


def _find_largest(mesh: object) -> int:
    """Number of the largest triangle."""
    return int(mesh.compute_cell_sizes(length=False, volume=False)["Area"].argmax())  # type: ignore[attr-defined]


def _faces_eye(mesh: object, towards_eye: Sequence[float]) -> bool:
    """Whether a face looks towards the eye at its largest triangle."""
    normals = mesh.compute_normals(  # type: ignore[attr-defined]
        point_normals=False, cell_normals=True, auto_orient_normals=False, consistent_normals=False
    )["Normals"]
    return bool(normals[_find_largest(mesh)] @ np.array(towards_eye) > 0)
