"""Pictures and films of mode shapes: the body deformed, in colour, with its frequency."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.mesh import Mesh
from figure.scene.caption import HEIGHT, Caption, Colouring, Layout, choose_layout, draw_annotations
from figure.scene.film import Image, check_suffix, paste, require_film_writer, save_film, save_gif, save_picture
from figure.scene.view import Scene, Vectors, choose_view, compute_enlargement, scene
from geometry.errors import InputError

Field = Literal["displacement", "von_mises"]
NodeValues = Float[NDArray[np.float64], " node"]

#: What the colour bar says, and a perceptually uniform colour map for it.
LABELS: dict[Field, tuple[str, str]] = {
    "displacement": ("Displacement", "viridis"),
    "von_mises": ("Von Mises stress", "plasma"),
}
#: Least width and height of the body's place [pixels].
SMALLEST = 100
#: Height of a film [pixels]: less than a picture's, for its 32 frames weigh as much as many pictures.
FILM_HEIGHT = 900
#: Frames of one period.
N_FRAME = 32


@dataclass(frozen=True, kw_only=True, eq=False)
class ModeColour:
    """Field shown by the colour of a mode shape.

    Parameters
    ----------
    field
        The magnitude of the displacement, or the von Mises stress given as `values`.
    values
        At the nodes, shape (n_node,); by default the magnitude of the displacement.
    unit
        Unit of the values. By default they are relative to their largest magnitude, since a mode shape has no scale.
    """

    field: Field = "displacement"
    values: NodeValues | None = None
    unit: str | None = None


DISPLACEMENT = ModeColour()


def mode_picture(
    mesh: Mesh,
    displacement: Vectors,
    path: str | PathLike[str],
    *,
    frequency: float,
    title: str = "",
    colour: ModeColour = DISPLACEMENT,
    amplitude: float | None = None,
    window_size: tuple[int, int] | None = None,
) -> Path:
    """Draw a mode shape into a PNG file.

    Parameters
    ----------
    mesh
        The body at rest.
    displacement
        Mode shape at the nodes, at any scale, shape (n_node, 3).
    path
        File to write, with the suffix .png.
    frequency
        Natural frequency, written into the caption [Hz].
    title
        First line of the caption, such as "Mode 1".
    colour
        Quantity that the colour represents.
    amplitude
        Largest deflection drawn [m]; by default a tenth of the body's largest dimension.
    window_size
        Width and height [pixels]; by default the body's shape decides.

    Returns
    -------
    The file written.

    Raises
    ------
    InputError
        Shapes that do not match the mesh, values that are not finite, or a suffix other than .png.
    MissingSoftware
        No picture can be drawn on this machine.
    OutputError
        The file cannot be written.
    """
    file = check_suffix(path, (".png",))
    deflection = _scale_deflection(mesh, displacement, amplitude)
    colouring = _make_colouring(mesh, displacement, colour)
    reached = np.concatenate([mesh.points, mesh.points + deflection])
    caption = _make_caption(frequency, title, deflection)
    with _prepare_scene(mesh, colouring, reached, caption, window_size, HEIGHT) as (canvas, place, drawn):
        picture = paste(canvas, [(*place, drawn.image(mesh.points + deflection))])
    save_picture(picture, file)
    return file


def mode_animation(
    mesh: Mesh,
    displacement: Vectors,
    path: str | PathLike[str],
    *,
    frequency: float,
    title: str = "",
    colour: ModeColour = DISPLACEMENT,
    amplitude: float | None = None,
    window_size: tuple[int, int] | None = None,
    n_frame: int = N_FRAME,
) -> Path:
    """Draw one period of a mode shape into a GIF, which repeats, or an MP4 film.

    Parameters
    ----------
    mesh, displacement, frequency, title, colour, amplitude, window_size
        As in `mode_picture`; the colour is that of the amplitude of the values, so that it stands still.
    path
        File to write, with the suffix .gif, or .mp4 where the package imageio-ffmpeg is installed.
    n_frame
        Frames of one period [-], at least 2.

    Raises
    ------
    InputError, MissingSoftware, OutputError
        As in `mode_picture`; also MissingSoftware for an MP4 without imageio-ffmpeg.
    """
    file = check_suffix(path, (".gif", ".mp4"))
    if n_frame < 2:
        raise InputError(f"n_frame = {n_frame} frames show no motion: give at least 2")
    if is_film := file.suffix.lower() == ".mp4":
        require_film_writer()
    deflection = _scale_deflection(mesh, displacement, amplitude)
    colouring = _make_colouring(mesh, displacement, colour)
    reached = np.concatenate([mesh.points + deflection, mesh.points - deflection])
    caption = _make_caption(frequency, title, deflection)
    with _prepare_scene(mesh, colouring, reached, caption, window_size, FILM_HEIGHT) as (canvas, place, drawn):
        # From the largest deflection on, so that a still preview shows the mode.
        phases = 2 * np.pi * np.arange(n_frame) / n_frame
        bodies = (drawn.image(mesh.points + np.cos(phase) * deflection) for phase in phases)
        frames = [paste(canvas, [(*place, body)]) for body in bodies]
    save = save_film if is_film else save_gif
    save(frames, file)
    return file


@contextmanager
def _prepare_scene(
    mesh: Mesh,
    colouring: Colouring,
    reached: Float[NDArray[np.float64], "point 3"],
    caption: Caption,
    window_size: tuple[int, int] | None,
    height: int,
) -> Iterator[tuple[Image, tuple[int, int], Scene]]:
    """The picture without its body, where the body goes (left, top), and the scene that draws it."""
    view = choose_view(reached)
    if window_size is None:
        layout = choose_layout(view.half_width / max(view.half_height, np.finfo(float).tiny), height)
    else:
        layout = Layout(width=window_size[0], height=window_size[1])
    left, top, width, body_height = layout.body
    if min(width, body_height) < SMALLEST:
        raise InputError(f"window_size = {window_size} pixels is too small for the body: give at least 300 x 300")
    with scene(mesh, colouring, view, (width, body_height)) as drawn:
        yield draw_annotations(layout, caption, colouring), (left, top), drawn


def _make_caption(frequency: float, title: str, deflection: Vectors) -> Caption:
    largest = float(np.linalg.norm(deflection, axis=1).max())
    hertz = f"{frequency:.2f} Hz"
    note = f"Largest deflection drawn as {largest * 1e3:.3g} mm; grey lines: the body at rest"
    return Caption(title=title or hertz, subtitle=hertz if title else "", note=note)


def _scale_deflection(mesh: Mesh, displacement: Vectors, amplitude: float | None) -> Vectors:
    shape = np.asarray(displacement, dtype=np.float64)
    if shape.shape != (mesh.n_node, 3):
        raise InputError(f"displacement has the shape {shape.shape}, but the mesh has {mesh.n_node} nodes: give (n, 3)")
    return shape * compute_enlargement(mesh, shape, amplitude)


def _make_colouring(mesh: Mesh, displacement: Vectors, colour: ModeColour) -> Colouring:
    if colour.field not in LABELS:
        raise InputError(f'field = "{colour.field}" is unknown: use one of {", ".join(LABELS)}')
    name, colour_map = LABELS[colour.field]
    values = colour.values
    if values is None:
        if colour.field != "displacement":
            raise InputError(f"{name} cannot be computed from a displacement alone: give it as values")
        values = np.linalg.norm(displacement, axis=1)
    scaled = np.asarray(values, dtype=np.float64)
    if scaled.shape != (mesh.n_node,) or not np.isfinite(scaled).all():
        raise InputError(f"values have the shape {scaled.shape}: give {mesh.n_node} finite ones, one per node")
    if colour.unit is None:
        scaled = scaled / (np.abs(scaled).max() or 1.0)
    low, high = min(0.0, float(scaled.min())), float(scaled.max())
    label = f"{name} / maximum [-]" if colour.unit is None else f"{name} [{colour.unit}]"
    return Colouring(values=scaled, limits=(low, high if high > low else low + 1.0), label=label, colour_map=colour_map)
