"""What stands around the picture of a body: caption, colour bar and note, laid out so that nothing meets."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from figure.style import INK, PALE

#: Room above, below and to the right of the body in a picture of `HEIGHT` pixels; other sizes scale it.
TOP, BOTTOM, RIGHT, LEFT = 128, 66, 200, 24
HEIGHT = 1300
DPI = 100
#: Width to height of the body's place; a more slender body leaves the sides free.
NARROWEST, WIDEST = 0.40, 1.5


@dataclass(frozen=True, kw_only=True)
class Caption:
    """Words of a picture.

    Parameters
    ----------
    title, subtitle
        First line, and the line below it.
    note
        Small, at the foot.
    label
        Of the colour bar, with its unit.
    limits
        Values at the ends of the colour bar.
    colour_map
        Its name in matplotlib.
    """

    title: str
    subtitle: str
    note: str
    label: str
    limits: tuple[float, float]
    colour_map: str


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Where things stand [pixels], from the top left corner.

    Parameters
    ----------
    width, height
        Of the whole picture.
    """

    width: int
    height: int

    @property
    def scale(self) -> float:
        """Size of text and room, relative to a picture of `HEIGHT` pixels; a narrow picture has smaller text."""
        return min(self.height / HEIGHT, self.width / (0.5 * HEIGHT))

    @property
    def body(self) -> tuple[int, int, int, int]:
        """Left, top, width and height of the picture of the body."""
        left, top, right, bottom = (round(room * self.scale) for room in (LEFT, TOP, RIGHT, BOTTOM))
        return left, top, self.width - left - right, self.height - top - bottom


def layout_for(aspect: float, height: int = HEIGHT) -> Layout:
    """Layout for a body whose picture has the given ratio of width to height; even numbers, as films want them."""
    scale = height / HEIGHT
    body_height = height - (TOP + BOTTOM) * scale
    width = body_height * float(np.clip(aspect, NARROWEST, WIDEST))
    if aspect > WIDEST:
        # A lying body: keep the width, and give back the height that it does not need.
        body_height = max(width / aspect, 0.4 * width)
    whole = (width + (LEFT + RIGHT) * scale, body_height + (TOP + BOTTOM) * scale)
    return Layout(width=2 * round(whole[0] / 2), height=2 * round(whole[1] / 2))


def furniture(layout: Layout, caption: Caption) -> NDArray[np.uint8]:
    """The picture without the body, shape (height, width, 3)."""
    # The figure classes alone: pyplot would look for a screen and keep state.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    width, height, scale = layout.width, layout.height, layout.scale
    points = 72 / DPI * scale  # a font size in points that is one pixel at full size
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    left = 34 * scale / width
    figure.text(left, 1 - 34 * scale / height, caption.title, size=36 * points, color=INK, va="top", weight="bold")
    figure.text(left, 1 - 82 * scale / height, caption.subtitle, size=31 * points, color=INK, va="top")
    figure.text(left, 26 * scale / height, caption.note, size=18 * points, color=PALE, va="bottom")
    body_left, body_top, body_width, body_height = layout.body
    bar_height = min(0.52 * body_height, 620 * scale)
    bar_bottom = height - body_top - 0.5 * (body_height + bar_height)
    place = ((body_left + body_width + 8 * scale) / width, bar_bottom / height, 30 * scale / width, bar_height / height)
    axes = figure.add_axes(place)
    mappable = ScalarMappable(norm=Normalize(*caption.limits), cmap=caption.colour_map)
    bar = figure.colorbar(mappable, cax=axes)
    bar.set_label(caption.label, size=22 * points, color=INK, labelpad=12 * points)
    bar.ax.tick_params(labelsize=20 * points, colors=INK, width=1.4 * points, length=6 * points, color=PALE)
    bar.outline.set_linewidth(0)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
