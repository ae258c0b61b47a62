"""Caption, colour bar and note around the picture of a body, laid out without overlap."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from figure.style import INK, PALE

#: Margins above, below, to the right and to the left of the body in a picture of `HEIGHT` pixels; other sizes scale it.
TOP, BOTTOM, RIGHT, LEFT = 128, 66, 200, 24
HEIGHT = 1300
DPI = 100
#: Width to height of the body's place; a more slender body leaves the sides free.
NARROWEST, WIDEST = 0.40, 1.5


@dataclass(frozen=True, kw_only=True)
class Caption:
    """Words of a picture: its first line, the line below it, and a small note at the foot."""

    title: str
    subtitle: str = ""
    note: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Colouring:
    """Field shown by the colours of bodies.

    Parameters
    ----------
    values
        At the nodes, shape (n_node,) [unit of the colour bar].
    limits
        Values at the ends of the colour bar [same unit].
    colour_map
        Colour map by its name in matplotlib, or its colours.
    label
        Label of the colour bar, with its unit.
    """

    values: Float[NDArray[np.float64], " node"]
    limits: tuple[float, float]
    colour_map: str | list[str]
    label: str = ""


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Positions of the parts of a picture [pixels], from the top left corner.

    Parameters
    ----------
    width, height
        Size of the whole picture.
    """

    width: int
    height: int

    @property
    def scale(self) -> float:
        """Size of text and margins, relative to a picture of `HEIGHT` pixels; a narrow picture has smaller text."""
        return min(self.height / HEIGHT, self.width / (0.5 * HEIGHT))

    @property
    def body(self) -> tuple[int, int, int, int]:
        """Left, top, width and height of the picture of the body."""
        left, top, right, bottom = (round(margin * self.scale) for margin in (LEFT, TOP, RIGHT, BOTTOM))
        return left, top, self.width - left - right, self.height - top - bottom


def choose_layout(aspect: float, height: int = HEIGHT) -> Layout:
    """Layout for a body whose picture has the given ratio of width to height; even numbers, as films want them."""
    scale = height / HEIGHT
    body_height = height - (TOP + BOTTOM) * scale
    width = body_height * float(np.clip(aspect, NARROWEST, WIDEST))
    if aspect > WIDEST:
        # A lying body: keep the width, and give back the height that it does not need.
        body_height = max(width / aspect, 0.4 * width)
    whole = (width + (LEFT + RIGHT) * scale, body_height + (TOP + BOTTOM) * scale)
    return Layout(width=2 * round(whole[0] / 2), height=2 * round(whole[1] / 2))


class Blank:
    """A picture without its bodies, with the words around them; the caller draws the rest and asks for its pixels.

    Parameters
    ----------
    layout, caption
        Layout and words of the picture.
    """

    def __init__(self, layout: Layout, caption: Caption) -> None:
        # The figure classes alone: pyplot would look for a screen and keep state.
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        width, height, scale = layout.width, layout.height, layout.scale
        #: A font size in points that is one pixel at full size.
        self.points = points = 72 / DPI * scale
        self.figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
        self._canvas = FigureCanvasAgg(self.figure)
        left, top = 34 * scale / width, 1 - 34 * scale / height
        self.figure.text(left, top, caption.title, size=36 * points, color=INK, va="top", weight="bold")
        self.figure.text(left, 1 - 82 * scale / height, caption.subtitle, size=31 * points, color=INK, va="top")
        self.figure.text(left, 26 * scale / height, caption.note, size=18 * points, color=PALE, va="bottom")

    def pixels(self) -> NDArray[np.uint8]:
        """Pixels drawn so far, shape (height, width, 3)."""
        self._canvas.draw()
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()


def draw_annotations(layout: Layout, caption: Caption, colouring: Colouring) -> NDArray[np.uint8]:
    """The picture without the body: words and a colour bar, shape (height, width, 3)."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    width, height, scale = layout.width, layout.height, layout.scale
    blank = Blank(layout, caption)
    points = blank.points
    body_left, body_top, body_width, body_height = layout.body
    bar_height = min(0.52 * body_height, 620 * scale)
    bar_bottom = height - body_top - 0.5 * (body_height + bar_height)
    place = ((body_left + body_width + 8 * scale) / width, bar_bottom / height, 30 * scale / width, bar_height / height)
    assert isinstance(colouring.colour_map, str)
    mappable = ScalarMappable(norm=Normalize(*colouring.limits), cmap=colouring.colour_map)
    bar = blank.figure.colorbar(mappable, cax=blank.figure.add_axes(place))
    bar.set_label(colouring.label, size=22 * points, color=INK, labelpad=12 * points)
    bar.ax.tick_params(labelsize=20 * points, colors=INK, width=1.4 * points, length=6 * points, color=PALE)
    bar.outline.set_linewidth(0)
    return blank.pixels()
