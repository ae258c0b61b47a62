"""How all figures look: their inks, numbers, axes without a box around them, and the whole as PNG."""

from io import BytesIO
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Of words, of words that matter less, and of the lines behind the curves.
INK, PALE, GRID = "#101820", "#5d6772", "#e5e7eb"


def open_box(axes: "Axes", grid: Literal["x", "y", "both"] = "both") -> None:
    """Leave only the two lines that have numbers, and draw a pale grid behind all else."""
    axes.grid(axis=grid, color=GRID, linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_axisbelow(True)


def add_title(figure: "Figure", title: str) -> None:
    """One bold line at the top left."""
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")


def three_digits(value: float) -> str:
    """A number to be read in a figure, without an exponent."""
    return f"{float(f'{value:.3g}'):,.10g}"


def png(figure: "Figure") -> bytes:
    """The figure as a file."""
    stream = BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()
