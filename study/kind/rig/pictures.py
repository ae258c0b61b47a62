"""Pictures of a rig as a stage: the bodies, the mesh at one contact line, and its first stuck modes."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.mesh import Mesh
from fe.mesher.whole_mesh import whole_mesh
from figure.scene.body_picture import bodies_picture, cut_picture
from figure.scene.mode_picture import mode_picture
from geometry.rig import Rig, mating_pairs
from pipeline.store import stage
from study.kind.rig.model import RigModel

#: The pair whose contact line is shown.
SHOWN = "right_blade"
#: Largest deflection drawn [m]: bodies that slide on each other shall not seem to part by more than their size.
AMPLITUDE = 0.015
#: The same in parts of what moves: of the middle one of the three sides of the box around it.
SHARE, MOVES = 0.35, 0.1


@stage("pictures of a rig")
def rig_pictures(model: RigModel, title: str) -> dict[str, NDArray[np.uint8]]:
    """Draw "assembly.png" and "contact.png"; bytes of each file by name."""
    meshes = model.meshes()
    whole = whole_mesh(meshes)
    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        folder = Path(name)
        note = f"{whole.n_node} nodes, {whole.n_cell} elements"
        bodies_picture(_kinds(meshes), folder / "assembly.png", title=title, subtitle="Bodies and mesh", note=note)
        _contact(model.rig, meshes, folder / "contact.png", title)
        return _contents(folder)


@stage("pictures of stuck modes of a rig", ignore=("report",))
def stuck_mode_pictures(
    model: RigModel,
    frequency: Float[NDArray[np.float64], " m"],
    displacement: Float[NDArray[np.float64], "m node 3"],
    report: Callable[[float, float], None],
) -> dict[str, NDArray[np.uint8]]:
    """Draw "mode1.png" and so on; bytes of each file by name.

    Parameters
    ----------
    model
        The rig.
    frequency
        Of the modes [Hz].
    displacement
        Of their shapes, at any scale, on the nodes of all bodies in their order.
    report
        Progress.
    """
    whole = whole_mesh(model.meshes())
    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        folder = Path(name)
        for number, (hertz, shape) in enumerate(zip(frequency, displacement, strict=True), start=1):
            file, title = folder / f"mode{number}.png", f"Stuck mode {number}"
            mode_picture(whole, shape, file, frequency=float(hertz), title=title, amplitude=_amplitude(whole, shape))
            report(number, len(frequency))
        return _contents(folder)


def _amplitude(whole: Mesh, shape: Float[NDArray[np.float64], "node 3"]) -> float:
    """Largest deflection drawn [m]: small for a mode in which small bodies move alone."""
    length = np.linalg.norm(shape, axis=1)
    sides = np.ptp(whole.points[length > MOVES * length.max()], axis=0)
    return min(AMPLITUDE, SHARE * float(np.sort(sides)[1]))


def _contact(rig: Rig, meshes: dict[str, Mesh], file: Path, title: str) -> None:
    pair = mating_pairs(rig)[SHOWN]
    touching = {body: meshes[body] for body in (pair.other, pair.damper)}
    cut_picture(
        _kinds(touching),
        pair.damper_line.stations,
        file,
        title=title,
        subtitle=f'Contact line "{SHOWN}"',
        note="Cut at x = 0, through the contact line",
    )


def _kinds(meshes: dict[str, Mesh]) -> dict[str, list[Mesh]]:
    """Meshes by kind of body, as a legend calls it."""
    words = {"blade": "blade", "damper": "damper", "decoupler": "de-coupler"}
    found: dict[str, list[Mesh]] = {}
    for body, mesh in meshes.items():
        found.setdefault(words[body.partition("_")[0]], []).append(mesh)
    return found


def _contents(folder: Path) -> dict[str, NDArray[np.uint8]]:
    return {file.name: np.frombuffer(file.read_bytes(), dtype=np.uint8) for file in sorted(folder.iterdir())}
