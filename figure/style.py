"""Style of all figures: colours, headings, numbers, axes without a box, and the output as PNG."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:
    # For annotations only: matplotlib is imported when something is drawn.
    Axes = Figure = Any

#: Dots per inch of all figures.
DPI = 160
#: Compression level, up to 9: half the time of zlib's default, for files larger by a tenth to a quarter.
COMPRESSION = 3
#: Colours of text, of secondary text, and of the grid lines behind the curves.
INK, PALE, GRID = "#101820", "#5d6772", "#e5e7eb"
#: Colours of a lower and an upper limit, distinguishable for colour-blind readers (Okabe and Ito, 2008).
LIMITS = ("#0072b2", "#d55e00")
#: Colours of contact states; "closed" is a contact without friction, which can neither stick nor slip.
CONTACT_STATES = {"stuck": "#0072b2", "slipping": "#e69f00", "closed": "#009e73", "separated": "#d1d5db"}
#: The same three inks, paper and a quiet ground on light and on dark pages, and words for what is good or bad: all
#: words have a contrast of 4.5 to their ground (WCAG 2.2, AA).
LIGHT_PAGE = {
    "ink": INK, "pale": PALE, "grid": GRID, "paper": "#ffffff", "ground": "#eef2f6", "line": "#c6d0da",
    "blue": "#1f4e79", "accent": "#b93d0a", "good": "#1e6b45", "bad": "#b91c1c", "marked": "#fff4ec",
}  # fmt: skip
DARK_PAGE = {
    "ink": "#e8edf2", "pale": "#a3b1bf", "grid": "#33404c", "paper": "#18212a", "ground": "#0f161d", "line": "#445464",
    "blue": "#8ec5f4", "accent": "#ff9d66", "good": "#6fd0a0", "bad": "#ff8f8f", "marked": "#2f2620",
}  # fmt: skip
#: Colours of an ordered family: the light end of the map would be invisible on white, the dark end on a dark page.
FIRST_COLOUR, LAST_COLOUR = 0.0, 0.82
FIRST_ON_DARK, LAST_ON_DARK = 0.38, 1.0
#: A legend longer than this is placed beside the curves, or in several rows.
LONGEST_LEGEND = 6
#: Widths of a letter of a legend, and of its sign with the gaps around it [inches].
LETTER, SIGN = 0.085, 0.75
#: Width of a bold letter of a title, over its size [-].
BOLD = 0.67
#: Ratio of the ends of a logarithmic axis below which there are numbers between the decades, too [-].
FEW_DECADES = 50.0
#: Length of a tick [points].
TICK = 3.5
#: Heading above the axes: its height, and where its two lines stand [inches from the top and from the left].
HEADING, TITLE, SUBTITLE, LEFT = 0.72, 0.12, 0.42, 0.12


@dataclass(frozen=True, kw_only=True, eq=False)
class TitledFigure:
    """A result with the title of its figure, and the smaller line below it."""

    title: str
    subtitle: str = ""


def make_figure(width: float, height: float, *, wspace: float | None = None, hspace: float | None = None) -> Figure:
    """An empty figure [inches] that keeps its axes clear of each other; gaps are as in matplotlib's layout engine."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    return Figure(figsize=(width, height), layout=ConstrainedLayoutEngine(wspace=wspace, hspace=hspace))


def make_bare_figure(width: float, height: float) -> Figure:
    """An empty figure [inches] whose axes stand where `add_axes` puts them: quick to draw where there are many."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height))


def add_axes(figure: Figure, left: float, top: float, width: float, height: float, **shared: Any) -> Axes:
    """Axes of a size and place [inches from the left and from the top]; `sharex` and `sharey` as in matplotlib."""
    across, down = figure.get_size_inches()
    return figure.add_axes((left / across, 1 - (top + height) / down, width / across, height / down), **shared)


def open_box(axes: Axes, grid: Literal["x", "y", "both"] = "both") -> None:
    """Keep only the two axis lines with numbers, and draw a pale grid in the background."""
    axes.grid(axis=grid, color=GRID, linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_axisbelow(True)


def use_log_scale(axes: Axes, along: Literal["x", "y"]) -> None:
    """Make an axis logarithmic, with decimal numbers at 1, 2 and 5 where it spans little, and else at the decades."""
    from matplotlib.ticker import FuncFormatter, LogFormatterSciNotation, LogLocator

    axes.set(**{f"{along}scale": "log"})
    axis = axes.xaxis if along == "x" else axes.yaxis
    power = LogFormatterSciNotation()
    power.set_axis(axis)

    def write(value: float, place: int | None = None) -> str:
        return f"{value:g}" if 1e-3 <= value < 1e4 else str(power(value, place))

    def write_between(value: float, place: int | None = None) -> str:
        low, high = axis.get_view_interval()
        return write(value, place) if high < FEW_DECADES * low else ""

    axis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(write))
    axis.set_minor_formatter(FuncFormatter(write_between))


def draw_ticks(panels: Sequence[Axes], named: Sequence[Axes]) -> None:
    """Draw grids, ticks and numbers of finished axes; the numbers below them only of those that are named.

    Matplotlib makes five artists per tick, which take most of the time of a figure of many axes. Here the lines of a
    grid are one artist, and so are the ticks of an axis.
    """
    for axes in panels:
        _draw_ticks(axes, "x", axes in named)
        _draw_ticks(axes, "y", True)
    for axes in panels:
        axes.set(xticks=[], yticks=[])


def _draw_ticks(axes: Axes, along: Literal["x", "y"], named: bool) -> None:
    from matplotlib.lines import Line2D

    axis, way = (axes.xaxis, 1) if along == "x" else (axes.yaxis, -1)
    across = axes.get_xaxis_transform() if along == "x" else axes.get_yaxis_transform()
    low, high = axis.get_view_interval()
    places = np.array([place for place in axis.get_majorticklocs() if low <= place <= high])
    ends, zeros = np.tile([0.0, 1.0, np.nan], len(places)), np.zeros(len(places))
    grid, marks = [np.repeat(places, 3), ends][::way], [places, zeros][::way]
    axes.add_artist(Line2D(*grid, color=GRID, linewidth=0.8, zorder=0.5, transform=across))
    axes.add_artist(
        Line2D(
            *marks, linestyle="none", marker=0 if along == "y" else 3, markersize=TICK, color="black",
            markeredgewidth=0.8, clip_on=False, transform=across,
        )
    )  # fmt: skip
    if not named:
        return
    text1 = axes.get_xaxis_text1_transform if along == "x" else axes.get_yaxis_text1_transform
    beside, va, ha = text1(2 * TICK)
    formatter = axis.get_major_formatter()
    for x, y, label in zip(*marks, formatter.format_ticks(list(places)), strict=True):
        axes.text(x, y, label, transform=beside, va=va, ha=ha)
    if offset := formatter.get_offset():
        axes.text(0.0, 1.0, offset, transform=axes.transAxes, va="bottom", ha="left")


def choose_family_colours(count: int, *, dark: bool = False) -> list[str]:
    """Colours of an ordered family of curves, also for colour-blind readers; for white or a dark page."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    ends = (FIRST_ON_DARK, LAST_ON_DARK) if dark else (FIRST_COLOUR, LAST_COLOUR)
    return [to_hex(colormaps["viridis"](place)) for place in np.linspace(*ends, count)]


def count_legend_columns(figure: Figure, labels: Sequence[str], most: int) -> int:
    """Number of columns of a legend below the axes: as many as fit into the width, up to a maximum."""
    for columns in range(min(len(labels), most), 1, -1):
        # A column is as wide as its own longest label; matplotlib fills one after the other.
        longest = [max(map(len, part)) for part in np.array_split(np.array(labels, dtype=object), columns)]
        if sum(SIGN + LETTER * length for length in longest) <= figure.get_figwidth():
            return columns
    return 1


def add_legend(
    figure: Figure,
    handles: Sequence[Any],
    labels: Sequence[str] | None = None,
    *,
    most: int = 8,
    loc: Literal["outside lower center", "outside lower left", "outside lower right"] = "outside lower center",
    **style: Any,
) -> None:
    """A legend below all panels, in as many columns as fit into the width.

    Parameters
    ----------
    figure
        With a constrained layout.
    handles, labels
        Its entries; by default each handle's own label.
    most
        Largest number of columns.
    loc
        Its location.
    style
        Further arguments of matplotlib's legend.
    """
    labels = [str(handle.get_label()) for handle in handles] if labels is None else labels
    ncols = count_legend_columns(figure, labels, most)
    figure.legend(handles, labels, loc=loc, ncols=ncols, frameon=False, **style)


def add_heading(figure: Figure, result: TitledFigure) -> None:
    """Write title and subtitle at the top left, and keep the axes of a constrained layout below them."""
    width, height = figure.get_size_inches()
    margin = LEFT / width
    heading = HEADING if result.subtitle else SUBTITLE
    if (engine := figure.get_layout_engine()) is not None:
        engine.set(rect=(margin / 2, 0.0, 1 - margin, 1 - heading / height))  # type: ignore[call-arg]
    room = 72 * (width - 2 * LEFT) / (BOLD * max(len(result.title), 1))
    figure.text(
        margin, 1 - TITLE / height, result.title, ha="left", va="top", fontsize=min(13, room), fontweight="bold",
        color=INK,
    )  # fmt: skip
    figure.text(margin, 1 - SUBTITLE / height, result.subtitle, ha="left", va="top", fontsize=10, color=PALE)


def add_title(figure: Figure, title: str) -> None:
    """Add a bold title at the top left."""
    figure.suptitle(title, x=0.01, ha="left", fontweight="bold")


def format_three_digits(value: float) -> str:
    """A number to be read in a figure, without an exponent."""
    return f"{float(f'{value:.3g}'):,.10g}"


def choose_evenly(count: int, most: int) -> list[int]:
    """Choose at most `most` of `count` places evenly, with the first and the last."""
    places = np.linspace(0, count - 1, min(count, most)).round().astype(int)
    return [int(place) for place in np.unique(places)]


def typeset_figure(figure: Figure) -> None:
    """`typeset` for all text of a figure: files and tables for computers have plain ASCII."""
    from matplotlib.text import Text
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            # Names at an axis are written anew with each tick.
            if isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter):
                labels = [label.get_text() for label in axis.get_ticklabels()]
                if (printed := [typeset(label) for label in labels]) != labels:
                    axis.set_ticks(axis.get_ticklocs(), labels=printed)
    for text in figure.findobj(Text):
        words = text.get_text()
        # Words between dollars are formulas, which matplotlib sets itself.
        if "$" not in words and (printed_words := typeset(words)) != words:
            text.set_text(printed_words)


def typeset(text: str) -> str:
    """Text in print: ± for +-, χ² for chi^2, µm for um, raised exponents."""
    text = text.replace("+-", "±").replace("chi^2", "χ²").replace("^2", "²").replace("^3", "³")
    return re.sub(r"\bum\b", "µm", text)


def png(figure: Figure) -> bytes:
    """The figure as a file."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    figure.set_dpi(DPI)
    typeset_figure(figure)
    canvas, stream = FigureCanvasAgg(figure), BytesIO()
    # Letters as they were designed: moved onto pixels they look no better at this size, and take a third longer.
    with rc_context({"text.hinting": "none"}):
        # `savefig` would draw the figure a second time for the layout.
        if (engine := figure.get_layout_engine()) is not None:
            engine.execute(figure)
            figure.set_layout_engine("none")
        canvas.draw()
    # Nothing is transparent: without the alpha channel a file takes a quarter less time, and is smaller.
    opaque = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    opaque.save(stream, "PNG", compress_level=COMPRESSION, dpi=(DPI, DPI))
    return stream.getvalue()
