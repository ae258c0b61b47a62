"""A part's mesh with its named faces in colours, and as dots its named nodes and the stations that stay physical."""

from collections.abc import Mapping
from itertools import cycle
from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.mesh import Mesh
from figure.scene.body_picture import THROUGH, Marks, save_with_legend
from figure.scene.caption import Caption, Colouring, choose_layout
from figure.scene.skin import find_patterned_faces
from figure.scene.view import TOWARDS_EYE, Vectors, choose_view, scene

Faces = Int[NDArray[np.int64], "_ 2"]

#: Of faces without a name, and of named ones in turn.
PLAIN = "#d5dae0"
COLOURS = ("#7fa6c9", "#e0903c", "#9bb48c", "#c58ba8", "#c9b458", "#6fbcb2", "#b58463", "#8f83c4")
#: Of the dots of named nodes: dark, to stand out from faces even where they are pale; and their size [pixels].
NODE_COLOURS = ("#6a1b9a", "#00695c", "#1a3fb0", "#7a4100")
NODE_SIZE = 10


def named_faces_picture(
    mesh: Mesh,
    faces: Mapping[str, Faces],
    stations: Vectors,
    path: str | PathLike[str],
    *,
    title: str,
    towards_eye: Float[NDArray[np.float64], "3"] = TOWARDS_EYE,
    nodes: Mapping[str, Vectors] | None = None,
) -> Path:
    """Draw a mesh into a PNG file.

    Parameters
    ----------
    mesh
        The part.
    faces
        Cell and local face of the faces of each name.
    stations
        Places that are marked, shape (station, 3) [m]; those behind the body are seen through it.
    path
        The file.
    title
        First line above.
    towards_eye
        Direction from the body towards the eye, shape (3,) [-].
    nodes
        Positions of the nodes or points of each name [m], marked like stations.

    Raises
    ------
    MissingSoftware
        No picture can be drawn on this machine.
    """
    view = choose_view(mesh.points, towards_eye)
    layout = choose_layout(view.half_width / view.half_height)
    nodes = nodes or {}
    colours = [PLAIN, *(COLOURS[k % len(COLOURS)] for k in range(len(faces)))]
    marks = [
        Marks(label=name, places=places, colour=colour, size=NODE_SIZE, seen_through=THROUGH)
        for (name, places), colour in zip(nodes.items(), cycle(NODE_COLOURS), strict=False)
    ]
    marks.append(Marks(label="stations", places=stations, seen_through=THROUGH))
    colouring = Colouring(values=np.zeros(mesh.n_node), limits=(-0.5, len(colours) - 0.5), colour_map=colours)
    behind = "; pale dots are behind" if any(len(item.places) for item in marks) else ""
    note = f"{mesh.n_node} nodes, {mesh.n_cell} elements{behind}"
    caption = Caption(title=title, subtitle="Mesh and named faces", note=note)
    with scene(mesh, colouring, view, layout.body[2:]) as drawn:
        drawn.surface.point_data["value"] = _number_points(mesh, faces)
        legend = dict(zip(faces, colours[1:], strict=True))
        return save_with_legend(drawn, mesh, layout, caption, legend, marks, Path(path))


def _number_points(mesh: Mesh, faces: Mapping[str, Faces]) -> Float[NDArray[np.float64], " point"]:
    """Number of the name of each point of the skin: those of one face have points of their own."""
    name_of: dict[tuple[int, ...], int] = {}
    for number, named in enumerate(faces.values(), start=1):
        for _, element, local, cells in mesh.face_groups(named):
            corners = np.sort(cells[:, element.corner_faces[local]], axis=1)
            name_of.update(dict.fromkeys(map(tuple, corners.tolist()), number))
    result = []
    for pattern, nodes in find_patterned_faces(mesh):
        keys = np.sort(nodes[:, : len(pattern.rims)], axis=1).tolist()
        result.append(np.repeat([float(name_of.get(tuple(key), 0)) for key in keys], len(pattern.value)))
    return np.concatenate(result)
