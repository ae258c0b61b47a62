"""Pictures of a rig as stages: bodies, the mesh at a contact line, first stuck modes, and a film of the deflection."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.mesh import Mesh
from fe.mesher.body import join_meshes
from figure.scene.body_picture import cut_picture, save_bodies_picture
from figure.scene.caption import Caption
from figure.scene.deflection_film import save_deflection_film
from figure.scene.mode_picture import mode_picture
from figure.scene.station_picture import StationStates
from geometry.rig import Rig, mating_pairs
from pipeline.store import stage
from study.kind.rig.model import RigModel
from study.modes.files import contents

#: Pair whose contact line is drawn.
SHOWN = "right_blade"
#: Largest drawn deflection [m]: bodies that slide on each other should not appear separated by more than their size.
AMPLITUDE = 0.015
#: Largest drawn deflection relative to the middle side of the box around the moving nodes [-]; a node moves if its
#: displacement exceeds this fraction of the largest [-].
LARGEST_DEFLECTION, MOVING = 0.35, 0.1


@stage("pictures of a rig")
def rig_pictures(model: RigModel, title: str) -> dict[str, NDArray[np.uint8]]:
    """Draw "assembly.png" and "contact.png", and return the bytes of each file by name."""
    meshes = model.meshes()
    whole = join_meshes(meshes)
    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        folder = Path(name)
        note = f"{whole.n_node} nodes, {whole.n_cell} elements"
        caption = Caption(title=title, subtitle="Bodies and mesh", note=note)
        save_bodies_picture(_group_by_kind(meshes), folder / "assembly.png", caption)
        _draw_contact(model.rig, meshes, folder / "contact.png", title)
        return contents(folder)


@stage("pictures of stuck modes of a rig", ignore=("report",))
def stuck_mode_pictures(
    model: RigModel,
    frequency: Float[NDArray[np.float64], " m"],
    displacement: Float[NDArray[np.float64], "m node 3"],
    report: Callable[[float, float], None],
) -> dict[str, NDArray[np.uint8]]:
    """Draw "mode1.png" and so on, and return the bytes of each file by name.

    Parameters
    ----------
    model
        Model of the rig.
    frequency
        Natural frequencies of the modes [Hz].
    displacement
        Mode shapes of any scale, on the nodes of all bodies in their order.
    report
        Function that receives the progress.
    """
    whole = join_meshes(model.meshes())
    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        folder = Path(name)
        for number, (hertz, shape) in enumerate(zip(frequency, displacement, strict=True), start=1):
            file, title = folder / f"mode{number}.png", f"Stuck mode {number}"
            mode_picture(
                whole, shape, file, frequency=float(hertz), title=title, amplitude=_choose_amplitude(whole, shape)
            )
            report(number, len(frequency))
        return contents(folder)


def _choose_amplitude(whole: Mesh, shape: Float[NDArray[np.float64], "node 3"]) -> float:
    """Choose the largest drawn deflection [m], smaller for a mode in which only small bodies move."""
    length = np.linalg.norm(shape, axis=1)
    sides = np.ptp(whole.points[length > MOVING * length.max()], axis=0)
    return min(AMPLITUDE, LARGEST_DEFLECTION * float(np.sort(sides)[1]))


def _draw_contact(rig: Rig, meshes: dict[str, Mesh], file: Path, title: str) -> None:
    pair = mating_pairs(rig)[SHOWN]
    touching = {body: meshes[body] for body in (pair.other, pair.damper)}
    note = "Cut at x = 0, through the contact line"
    caption = Caption(title=title, subtitle=f'Contact line "{SHOWN}"', note=note)
    cut_picture(_group_by_kind(touching), pair.damper_line.stations, file, caption)


def _group_by_kind(meshes: dict[str, Mesh]) -> dict[str, list[Mesh]]:
    """Group the meshes by kind of body, with its name in a legend."""
    words = {"blade": "blade", "damper": "damper", "decoupler": "de-coupler"}
    result: dict[str, list[Mesh]] = {}
    for body, mesh in meshes.items():
        result.setdefault(words[body.partition("_")[0]], []).append(mesh)
    return result


@stage("film of a rig")
def rig_film(
    model: RigModel,
    displacement: NDArray[np.float64],
    status: Int[NDArray[np.int64], "frame station"],
    title: str,
    subtitle: str,
) -> NDArray[np.uint8]:
    """Draw the film of the deflection, and return its bytes."""
    whole = join_meshes(model.meshes())
    nodes = [whole.node_sets[f"{pair.other}.{pair.other_line.name}"] for pair in mating_pairs(model.rig).values()]
    stations = StationStates(node=np.concatenate(nodes), states=status)
    with tempfile.TemporaryDirectory(prefix="stickslip-") as name:
        file = save_deflection_film(
            whole, displacement, Path(name) / "film.gif", title=title, subtitle=subtitle, amplitude=AMPLITUDE,
            stations=stations,
        )  # fmt: skip
        return np.frombuffer(file.read_bytes(), dtype=np.uint8)
