"""The film of a rig's deflection as a stage."""

import tempfile
from pathlib import Path

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from fe.mesher.whole_mesh import whole_mesh
from figure.scene.deflection_film import deflection_film
from figure.scene.station_picture import StationStates
from geometry.rig import mating_pairs
from pipeline.store import stage
from study.kind.rig.model import RigModel
from study.kind.rig.pictures import AMPLITUDE


@stage("film of a rig")
def rig_film(
    model: RigModel,
    displacement: NDArray[np.float64],
    status: Int[NDArray[np.int64], "frame station"],
    title: str,
    subtitle: str,
) -> NDArray[np.uint8]:
    """Bytes of the film."""
    whole = whole_mesh(model.meshes())
    nodes = [whole.node_sets[f"{pair.other}.{pair.other_line.name}"] for pair in mating_pairs(model.rig).values()]
    stations = StationStates(node=np.concatenate(nodes), states=status)
    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        file = deflection_film(
            whole, displacement, Path(name) / "film.gif", title=title, subtitle=subtitle, amplitude=AMPLITUDE,
            stations=stations,
        )  # fmt: skip
        return np.frombuffer(file.read_bytes(), dtype=np.uint8)
