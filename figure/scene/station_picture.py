"""Contact stations from near by: the bodies cut open beside them, each a dot in the colour of its state."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.mesh import Mesh
from figure.line_states import STATES, refuse_unknown_states
from figure.scene.caption import DPI, Colouring
from figure.scene.film import Image, Part
from figure.scene.off_screen import load_pyvista_off_screen
from figure.scene.view import OVERSAMPLING, Scene, Vectors, View, behind, choose_view, scene
from figure.style import INK
from geometry.errors import InputError

#: Seen beyond the outermost stations, as a part of their extent [-] and at least so far [m].
AROUND, LEAST_AROUND = 0.12, 0.008
#: Largest and least ratio of width to height of the picture [-].
FLATTEST, STEEPEST = 1.6, 0.8
#: Margins for the words above and below it [pixels, as in a caption].
ABOVE, BELOW = 48, 56
#: From the stations towards the eye: nearly along x, from the side from which the bodies are seen.
TOWARDS_EYE = np.array([0.96, -0.16, 0.22])
#: Diameters of a station and of its white rim, which parts it from the colours of the bodies [pixels].
DOT, RIM = 8.5, 12.0
#: Stations and rims stand so many times the depth of the view before their places, in front of all bodies [-].
DOT_BEFORE, RIM_BEFORE = 2.0, 1.9
#: Around the picture, and around the dots of the legend.
FRAME_GREY, DOT_EDGE = 176, "#9aa3ad"


@dataclass(frozen=True, kw_only=True, eq=False)
class StationStates:
    """Contact stations and what they do at each frame of a film.

    Parameters
    ----------
    node
        Node of the mesh at each station, shape (station,) [-].
    states
        0 stuck, 1 slipping, 2 separated, shape (frame, station) [-].

    Raises
    ------
    InputError
        No station, shapes that do not match, or other states.
    """

    node: Int[NDArray[np.int64], " station"]
    states: Int[NDArray[np.int64], "frame station"]

    def __post_init__(self) -> None:
        node = np.array(self.node, dtype=np.int64)
        node.setflags(write=False)
        states = refuse_unknown_states("states of stations", self.states)
        if node.ndim != 1 or node.size == 0:
            raise InputError(f"node has the shape {node.shape}: give (station,) with at least one station")
        if states.ndim != 2 or states.shape[1] != len(node):
            raise InputError(f"states have the shape {states.shape}: give (frame, {len(node)})")
        object.__setattr__(self, "node", node)
        object.__setattr__(self, "states", states)


def draw_station_pictures(
    mesh: Mesh,
    places: Float[NDArray[np.float64], "frame node 3"],
    colouring: Colouring,
    stations: StationStates,
    box: tuple[int, int, int, int],
    scale: float,
) -> list[list[Part]]:
    """Pictures of the stations with their words, in the middle of a box.

    Parameters
    ----------
    mesh
        The bodies at rest.
    places
        Positions of the nodes at each frame, shape (n_frame, n_node, 3) [m].
    colouring
        Colouring of the bodies.
    stations
        Nodes and states of the stations.
    box
        Left, top, width and height [pixels].
    scale
        Size of text and margins, as in a layout [-].

    Returns
    -------
    What to paste at each frame.

    Raises
    ------
    MissingSoftware
        No picture can be drawn on this machine.
    """
    left, top, width, height = box
    above, below = round(ABOVE * scale), round(BELOW * scale)
    view = _view(mesh.points, places[:, stations.node].reshape(-1, 3))
    aspect = float(np.clip(view.half_width / view.half_height, STEEPEST, FLATTEST))
    size = (width, min(round(width / aspect), height - above - below))
    top += (height - above - size[1] - below) // 2
    heading = _draw_words((width, above), "Contact stations, bodies cut open", scale)
    half = behind(mesh, float(mesh.points[stations.node, 0].mean()))
    cut = half if half.n_cell else mesh
    result: list[list[Part]] = []
    with scene(cut, colouring, view, size) as drawn:
        dots = _Dots(drawn, view, mesh.points[stations.node])
        for number, (nodes, states) in enumerate(zip(places, stations.states, strict=True)):
            dots.move(nodes[stations.node], states)
            picture = _add_frame(drawn.image(nodes))
            words = _draw_words((width, below), f"time / period = {number / len(places):.3f}", scale, STATES)
            result.append([(left, top, heading), (left, top + above, picture), (left, top + above + size[1], words)])
    return result


class _Dots:
    """Stations in front of all bodies: a parallel projection draws them where they are.

    Parameters
    ----------
    drawn
        The scene to add them to.
    view
        View of the scene.
    points
        The stations at rest, shape (station, 3) [m].
    """

    def __init__(self, drawn: Scene, view: View, points: Vectors) -> None:
        self._plotter = drawn.plotter
        # Points are drawn as spheres: those of the rims must not reach in front of the dots.
        self._to_dot, self._to_rim = (share * view.depth * view.towards_eye for share in (DOT_BEFORE, RIM_BEFORE))
        polydata = load_pyvista_off_screen().PolyData
        self._dot, self._rim = polydata(points + self._to_dot), polydata(points + self._to_rim)
        self._dot.point_data["state"] = np.zeros(len(points))
        look: dict[str, Any] = {"style": "points", "render_points_as_spheres": True, "lighting": False}
        look |= {"reset_camera": False, "show_scalar_bar": False}
        self._plotter.add_mesh(self._rim, color="white", point_size=RIM * OVERSAMPLING, **look)
        colours = {"scalars": "state", "cmap": list(STATES.values()), "clim": (-0.5, len(STATES) - 0.5)}
        self._plotter.add_mesh(self._dot, point_size=DOT * OVERSAMPLING, **colours, **look)

    def move(self, points: Vectors, states: Int[NDArray[np.int64], " station"]) -> None:
        """Put the stations at new points, in the colours of their states."""
        self._dot.points, self._rim.points = points + self._to_dot, points + self._to_rim
        self._dot.point_data["state"] = states.astype(np.float64)
        self._plotter.reset_camera_clipping_range()


def _view(everything: Vectors, reached: Vectors) -> View:
    """Look at all that the stations reach, and a little around it."""
    tight = choose_view(reached, TOWARDS_EYE)
    around = max(2 * AROUND * max(tight.half_width, tight.half_height), LEAST_AROUND)
    return replace(
        tight,
        half_width=tight.half_width + around,
        half_height=tight.half_height + around,
        depth=float(np.linalg.norm(everything - tight.centre, axis=1).max()),
    )


def _add_frame(picture: Image) -> Image:
    picture = picture.copy()
    picture[[0, -1]] = FRAME_GREY
    picture[:, [0, -1]] = FRAME_GREY
    return picture


def _draw_words(size: tuple[int, int], text: str, scale: float, legend: Mapping[str, str] | None = None) -> Image:
    """A line of text, at the right of a legend where there is one."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    points = 72 / DPI * scale  # a font size in points that is one pixel at full size
    figure = Figure(figsize=(size[0] / DPI, size[1] / DPI), dpi=DPI, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    place, side = (0.0, "left") if legend is None else (1.0, "right")
    figure.text(place, 0.5, text, size=22 * points, color=INK, va="center", ha=side)
    if legend is not None:
        handles = [
            Line2D([], [], ls="", marker="o", ms=20 * points, mfc=colour, mec=DOT_EDGE, mew=0.5, label=name)
            for name, colour in legend.items()
        ]
        figure.legend(
            handles=handles,
            loc="center left",
            bbox_to_anchor=(0, 0.5),
            ncols=len(handles),
            fontsize=22 * points,
            handlelength=1.0,
            handletextpad=0.5,
            columnspacing=1.2,
            borderaxespad=0,
            borderpad=0,
            labelcolor=INK,
            frameon=False,
        )
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
