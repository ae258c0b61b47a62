"""Pictures of several bodies, each in a colour of its own: an assembly, and a cut through the mesh at a contact."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np

from fe.mesh import Mesh
from fe.mesher.body import join_meshes
from figure.scene.caption import Blank, Caption, Colouring, Layout, choose_layout
from figure.scene.film import Image, save_picture
from figure.scene.view import OVERSAMPLING, TOWARDS_EYE, Scene, Vectors, View, behind, choose_view, scene
from figure.style import INK

#: Colours of the bodies in the order in which they are given.
COLOURS = ("#7fa6c9", "#e0903c", "#9bb48c", "#c58ba8", "#c9b458")
#: Of the stations of a contact line.
STATION_COLOUR, STATION_SIZE = "#b3001b", 11
#: Between the legend and the edge [px at full size].
MARGIN = 12
NO_STATIONS = np.zeros((0, 3))
#: How much is seen of a point through the body before it.
THROUGH = 0.4
#: What puts a point before all of the body, in lifts of `scene`: twice the body's radius.
IN_FRONT = 1000
#: What is seen of a cut around a contact line, beyond its ends [m].
AROUND = 0.012
#: From a cut at x = 0 towards the eye: nearly square to it, so that lengths can be compared.
TOWARDS_CUT = np.array([0.94, 0.22, 0.26])


@dataclass(frozen=True, kw_only=True, eq=False)
class Marks:
    """Places that are marked by dots.

    Parameters
    ----------
    label
        Text in the legend.
    places
        Shape (n, 3) [m].
    colour, size
        Colour and size of the dots [pixels].
    seen_through
        Opacity of the dots that the body hides [-].
    """

    label: str
    places: Vectors
    colour: str = STATION_COLOUR
    size: float = STATION_SIZE
    seen_through: float = 0.0


def save_bodies_picture(bodies: Mapping[str, list[Mesh]], path: str | PathLike[str], caption: Caption) -> Path:
    """Draw bodies in their places into a PNG file.

    Parameters
    ----------
    bodies
        Meshes by what the legend calls them; those under one name have one colour.
    path
        The file.
    caption
        Words above and below.

    Raises
    ------
    MissingSoftware
        No picture can be drawn on this machine.
    """
    view = choose_view(np.concatenate([mesh.points for group in bodies.values() for mesh in group]), TOWARDS_EYE)
    return _draw(bodies, Path(path), view, caption)


def cut_picture(
    bodies: Mapping[str, list[Mesh]],
    stations: Vectors,
    path: str | PathLike[str],
    caption: Caption,
) -> Path:
    """Draw what lies on the side x < 0 around a contact line in the plane x = 0, into a PNG file.

    Parameters
    ----------
    bodies, path, caption
        As in `save_bodies_picture`.
    stations
        Stations of the contact line, shape (n_station, 3) [m].
    """
    halves = {name: [behind(mesh, x=0.0) for mesh in group] for name, group in bodies.items()}
    low, high = stations.min(axis=0) - AROUND, stations.max(axis=0) + AROUND
    corners = np.array([[0.0, y, z] for y in (low[1], high[1]) for z in (low[2], high[2])])
    near = choose_view(corners, TOWARDS_CUT)
    everything = np.concatenate([mesh.points for group in halves.values() for mesh in group])
    depth = float(np.linalg.norm(everything - near.centre, axis=1).max())
    return _draw(halves, Path(path), replace(near, depth=depth), caption, stations)


def _draw(
    bodies: Mapping[str, list[Mesh]],
    file: Path,
    view: View,
    caption: Caption,
    stations: Vectors = NO_STATIONS,
) -> Path:
    layout = choose_layout(view.half_width / view.half_height)
    colours = list(COLOURS[: len(bodies)])
    mesh = join_meshes({f"{name} {k}": item for name, group in bodies.items() for k, item in enumerate(group)})
    # Of the colour of each node.
    number = np.repeat(np.arange(float(len(bodies))), [sum(item.n_node for item in group) for group in bodies.values()])
    colouring = Colouring(values=number, limits=(-0.5, len(bodies) - 0.5), colour_map=colours)
    with scene(mesh, colouring, view, layout.body[2:]) as drawn:
        legend, marks = dict(zip(bodies, colours, strict=True)), Marks(label="stations", places=stations)
        return save_with_legend(drawn, mesh, layout, caption, legend, [marks], file)


def save_with_legend(
    drawn: Scene,
    mesh: Mesh,
    layout: Layout,
    caption: Caption,
    legend: Mapping[str, str],
    marks: Sequence[Marks],
    file: Path,
) -> Path:
    """Mark places in a scene, and write what it shows of a mesh beside words and a legend of colours by name."""
    left, top, width, height = layout.body
    marks = [item for item in marks if len(item.places)]
    for item in marks:
        _draw_dots(drawn, item, item.places + 2 * drawn.lift, 1.0)
        if item.seen_through:
            # Before the whole body: a parallel projection shows them where they are.
            _draw_dots(drawn, item, item.places + IN_FRONT * drawn.lift, item.seen_through)
    drawn.plotter.reset_camera_clipping_range()
    picture = _draw_annotations(layout, caption, legend, marks)
    picture[top : top + height, left : left + width] = drawn.image(mesh.points)
    save_picture(picture, file)
    return file


def _draw_dots(drawn: Scene, marks: Marks, places: Vectors, opacity: float) -> None:
    drawn.plotter.add_points(
        places,
        color=marks.colour,
        point_size=marks.size * OVERSAMPLING,
        render_points_as_spheres=True,
        lighting=False,
        opacity=opacity,
    )


def _draw_annotations(layout: Layout, caption: Caption, legend: Mapping[str, str], marks: Sequence[Marks]) -> Image:
    """The picture without the bodies: words, and a legend where other pictures have a colour bar."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    width, height, scale = layout.width, layout.height, layout.scale
    blank = Blank(layout, caption)
    points = blank.points
    body_left, body_top, body_width, body_height = layout.body
    handles: list[Patch | Line2D] = [Patch(color=colour, label=name) for name, colour in legend.items()]
    handles += [
        Line2D([], [], ls="", marker="o", ms=9 * points * item.size / STATION_SIZE, color=item.colour, label=item.label)
        for item in marks
    ]
    key = blank.figure.legend(
        handles=handles,
        loc="center left",
        bbox_to_anchor=((body_left + body_width) / width, 1 - (body_top + body_height / 2) / height),
        fontsize=20 * points,
        handlelength=1.1,
        labelcolor=INK,
        frameon=False,
    )
    blank.pixels()
    box = key.get_window_extent()
    if box.x1 > width - MARGIN * scale:
        # A long name is written smaller rather than cut.
        shrink = (width - MARGIN * scale - box.x0) / box.width
        for text in key.get_texts():
            text.set_fontsize(text.get_fontsize() * shrink)
    return blank.pixels()
