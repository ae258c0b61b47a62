"""Films of an operating deflection: the bodies over one period, and beside them their contact stations from near by."""

from os import PathLike
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.mesh import Mesh
from figure.line_states import STATES
from figure.scene.caption import Caption, Colouring, Layout, choose_layout, draw_annotations
from figure.scene.film import Image, Part, check_suffix, paste, save_exact_gif
from figure.scene.mode_picture import FILM_HEIGHT
from figure.scene.station_picture import StationStates, draw_station_pictures
from figure.scene.view import choose_view, compute_enlargement, scene
from figure.style import format_three_digits
from geometry.errors import InputError

Motion = Float[NDArray[np.float64], "frame node 3"]

COLOUR_MAP = "viridis"
#: Width of the picture of the stations, and of the gaps beside it [pixels, as in a caption].
NEAR, GAP = 820, 30
#: From here on the colour bar counts in millimetres [m].
LARGE = 1e-3


def save_deflection_film(
    mesh: Mesh,
    displacement: Motion,
    path: str | PathLike[str],
    *,
    title: str,
    subtitle: str = "",
    amplitude: float | None = None,
    stations: StationStates | None = None,
) -> Path:
    """Draw one period of a motion into a GIF, which repeats.

    The colour shows how far each point gets from its place in the period, so that it stands still.

    Parameters
    ----------
    mesh
        The bodies at rest.
    displacement
        At the nodes at instants evenly spaced from the start of the period, its end left out, shape
        (n_frame, n_node, 3) [m]; `hbsolve.fourier.samples_from_coefficients` gives it from harmonics.
    path
        File to write, with the suffix .gif.
    title, subtitle
        Above the picture; the subtitle may give frequency and level.
    amplitude
        Largest deflection drawn [m]; by default a tenth of the bodies' largest dimension.
    stations
        Also drawn from near by, the bodies cut open where they are (at their mean x) and seen nearly along x.

    Returns
    -------
    The file written.

    Raises
    ------
    InputError
        Shapes that do not match the mesh or each other, values that are not finite, or a suffix other than .gif.
    MissingSoftware
        No picture can be drawn on this machine.
    OutputError
        The file cannot be written.
    """
    file = check_suffix(path, (".gif",))
    motion = _check_displacement(mesh, displacement)
    enlarged = compute_enlargement(mesh, motion, amplitude)
    if stations is not None:
        _check_stations(mesh, motion, stations)
    reached = np.linalg.norm(motion, axis=2).max(axis=0)
    largest = float(reached.max())
    unit, per_metre = ("mm", 1e3) if largest >= LARGE else ("µm", 1e6)
    # Both pictures take their colours from all bodies, so that one bar serves both.
    colouring = Colouring(
        values=per_metre * reached,
        limits=(0.0, per_metre * largest if largest > 0 else 1.0),
        colour_map=COLOUR_MAP,
        label=f"Largest displacement in the period [{unit}]",
    )
    note = f"Deflection drawn {format_three_digits(enlarged)} times as large; grey lines: the bodies at rest"
    caption = Caption(title=title, subtitle=subtitle, note=note)
    film = _draw_frames(mesh, mesh.points + enlarged * motion, colouring, caption, stations)
    save_exact_gif(film, file, keep=("white", *STATES.values()))
    return file


def _draw_frames(
    mesh: Mesh, places: Motion, colouring: Colouring, caption: Caption, stations: StationStates | None
) -> list[Image]:
    view = choose_view(places.reshape(-1, 3))
    layout = choose_layout(view.half_width / max(view.half_height, np.finfo(float).tiny), FILM_HEIGHT)
    left, top, width, height = layout.body
    with scene(mesh, colouring, view, (width, height)) as drawn:
        parts: list[list[Part]] = [[(left, top, drawn.image(nodes))] for nodes in places]
    whole = layout
    if stations is not None:
        near, gap = round(NEAR * layout.scale), round(GAP * layout.scale)
        box = (left + width + gap, top, near, height)
        for own, more in zip(
            parts, draw_station_pictures(mesh, places, colouring, stations, box, layout.scale), strict=True
        ):
            own.extend(more)
        # Even, as `choose_layout` makes it.
        whole = Layout(width=layout.width + 2 * ((near + 2 * gap) // 2), height=layout.height)
    canvas = draw_annotations(whole, caption, colouring)
    return [paste(canvas, own) for own in parts]


def _check_displacement(mesh: Mesh, displacement: Motion) -> Motion:
    motion = np.asarray(displacement, dtype=np.float64)
    if motion.ndim != 3 or len(motion) < 2 or motion.shape[1:] != (mesh.n_node, 3):
        raise InputError(
            f"displacement has the shape {motion.shape}, but the mesh has {mesh.n_node} nodes: "
            f"give (n_frame, {mesh.n_node}, 3) with at least 2 frames"
        )
    return motion


def _check_stations(mesh: Mesh, motion: Motion, stations: StationStates) -> None:
    if len(stations.states) != len(motion):
        raise InputError(f"states are of {len(stations.states)} frames, but displacement is of {len(motion)}")
    outside = stations.node[(stations.node < 0) | (stations.node >= mesh.n_node)]
    if outside.size:
        raise InputError(f"a station is at node {outside[0]}: the mesh has nodes 0 to {mesh.n_node - 1}")
