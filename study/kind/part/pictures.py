"""Pictures of a part's mesh as a stage: its named faces in colour and its named nodes, from both sides."""

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.mesh import Mesh
from figure.scene.named_faces import named_faces_picture
from pipeline.store import stage

#: From the body towards the eye, in each picture.
VIEWS = {"faces.png": (0.80, -0.62, 0.36), "faces_behind.png": (-0.80, 0.62, -0.36)}


@stage("pictures of a part")
def face_pictures(
    mesh: Mesh,
    faces: Mapping[str, Int[NDArray[np.int64], "_ 2"]],
    stations: Float[NDArray[np.float64], "station 3"],
    title: str,
    nodes: Mapping[str, Float[NDArray[np.float64], "_ 3"]],
) -> dict[str, NDArray[np.uint8]]:
    """Draw "faces.png" and "faces_behind.png"; bytes of each file by name."""
    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        folder, found = Path(name), {}
        for file, towards_eye in VIEWS.items():
            eye = np.array(towards_eye)
            named_faces_picture(mesh, faces, stations, folder / file, title=title, towards_eye=eye, nodes=nodes)
            found[file] = np.frombuffer((folder / file).read_bytes(), dtype=np.uint8)
        return found
