"""Title and subtitle of a figure, with room of their own above its axes."""

from typing import TYPE_CHECKING

from figure.style import INK, PALE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Room above the axes, and what stands where in it [inches from the top].
ROOM, TITLE, SUBTITLE, LEFT = 0.72, 0.12, 0.42, 0.12


def add_heading(figure: "Figure", title: str, subtitle: str) -> None:
    """Write both at the top left, and keep the axes of a constrained layout below them."""
    width, height = figure.get_size_inches()
    engine = figure.get_layout_engine()
    assert engine is not None
    margin = LEFT / width
    engine.set(rect=(margin / 2, 0.0, 1 - margin, 1 - ROOM / height))  # type: ignore[call-arg]
    figure.text(margin, 1 - TITLE / height, title, ha="left", va="top", fontsize=13, fontweight="bold", color=INK)
    figure.text(margin, 1 - SUBTITLE / height, subtitle, ha="left", va="top", fontsize=10, color=PALE)
