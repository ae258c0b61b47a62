"""Every figure, those from outside too, can be opened, names the unit of its axes, and hides and clips no data."""

import re
import warnings
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter, NullFormatter
from PIL import Image

from figure.registry import REGISTRY, FigureKind, pictures
from figure.response_curves import ResponseCurves
from figure.style import TitledFigure, add_heading, make_figure, png
from geometry.errors import InputWarning, RegistryError
from tests.figure.examples import EXAMPLES

OUTSIDE = Path(__file__).parents[1] / "extension" / "nyquist_figure.py"
#: Line ends may stand out of the axes by so much of their length, as round-off of the limits.
ROUND_OFF = 1e-9


def kinds() -> Iterator[FigureKind]:
    """Those of the product, and one from outside; the other tests of this process do without it."""
    yield from REGISTRY
    (outside,) = REGISTRY.load(OUTSIDE)
    REGISTRY.forget(OUTSIDE)
    yield outside


@pytest.fixture(scope="module", params=list(kinds()), ids=lambda kind: kind.name)
def kind(request: pytest.FixtureRequest) -> FigureKind:
    return request.param


@pytest.fixture(scope="module")
def picture(kind: FigureKind) -> tuple[Figure, bytes]:
    """The figure of an example, laid out, and its file."""
    drawn: Figure = kind.draw(EXAMPLES[kind.draws]())
    return drawn, png(drawn)


@pytest.fixture(scope="module")
def figure(picture: tuple[Figure, bytes]) -> Figure:
    return picture[0]


def shown_axes(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.axison and axes.get_visible()]


def test_every_result_has_a_figure_of_its_own_and_an_example() -> None:
    own = [kind.draws for kind in REGISTRY if kind.is_own]
    assert len(own) == len(set(own))
    assert set(own) == set(EXAMPLES)


def test_it_is_a_picture_that_can_be_opened(picture: tuple[Figure, bytes]) -> None:
    with Image.open(BytesIO(picture[1])) as opened:
        shades = np.asarray(opened.convert("L"))
    assert min(shades.shape) > 300
    assert shades.min() < 100 < 250 < shades.max()


def test_micrometres_are_printed_with_their_letter(figure: Figure) -> None:
    assert not [text.get_text() for text in figure.findobj(Text) if re.search(r"\bum\b", text.get_text())]


def test_micrometres_of_results_and_of_names_at_an_axis_are_printed_with_their_letter() -> None:
    drawn = make_figure(3, 3)
    axes = drawn.subplots()
    axes.set(xlabel="gap [um]", ylabel="number", title="album of 3 um")
    axes.set_yticks([0, 1], labels=["0.1 um", "N/um"])
    png(drawn)
    assert (axes.get_xlabel(), axes.get_title()) == ("gap [µm]", "album of 3 µm")
    assert [label.get_text() for label in axes.get_yticklabels()] == ["0.1 µm", "N/µm"]


def test_an_axis_of_numbers_names_its_unit(figure: Figure) -> None:
    names = FixedFormatter | FuncFormatter | NullFormatter
    for which in ("xaxis", "yaxis"):
        axes = [getattr(item, which) for item in shown_axes(figure)]
        axes = [item for item in axes if any(tick.get_text() for tick in item.get_ticklabels())]
        numbers = [item for item in axes if not isinstance(item.get_major_formatter(), names)]
        # The label of several axes stands at one of them, or beside them all.
        words = [item.get_label_text() for item in numbers]
        words += [text.get_text() for text in (figure._supxlabel, figure._supylabel) if text is not None]
        labelled = [word for word in words if word]
        assert labelled or not numbers
        for word in labelled:
            assert "[" in word or "standard deviation" in word, word


def test_no_curve_is_clipped(figure: Figure) -> None:
    for axes in shown_axes(figure):
        for line in axes.lines:
            if line.get_transform() != axes.transData:
                continue  # a line across the axes
            for values, limits in ((line.get_xdata(), axes.get_xlim()), (line.get_ydata(), axes.get_ylim())):
                numbers = np.asarray(values, dtype=float)
                slack = ROUND_OFF * abs(limits[1] - limits[0])
                inside = (numbers >= min(limits) - slack) & (numbers <= max(limits) + slack)
                assert inside[np.isfinite(numbers)].all()


def test_no_legend_lies_over_a_curve(figure: Figure) -> None:
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
    for box in [legend.get_window_extent() for legend in legends]:
        for axes in shown_axes(figure):
            for line in axes.lines:
                points = line.get_transform().transform(np.column_stack([np.ravel(v) for v in line.get_data()]))
                finite = points[np.isfinite(points).all(axis=1)]
                assert not box.count_contains(finite)


def test_no_title_label_or_legend_leaves_the_page(figure: Figure) -> None:
    page = figure.bbox
    texts = [text for text in figure.texts if text.get_text()]
    parts = [*texts, *figure.legends, *(axes.title for axes in shown_axes(figure))]
    for axes in shown_axes(figure):
        parts += [label for label in (axes.xaxis.label, axes.yaxis.label) if label.get_text()]
    for part in parts:
        box = part.get_window_extent()
        # One pixel of rounding.
        assert box.x0 > page.x0 - 1
        assert box.x1 < page.x1 + 1
        assert box.y0 > page.y0 - 1
        assert box.y1 < page.y1 + 1


def test_a_figure_that_lacks_a_fact_is_refused() -> None:
    with pytest.raises(RegistryError, match=r'"half" lacks draws'):
        REGISTRY.register(type("Half", (), {"name": "half", "draw": print})())  # type: ignore[arg-type]
    for wrong in ({"draws": "ResponseCurves"}, {"draw": None}, {"name": "a/b"}):
        whole = {"name": "whole", "draws": ResponseCurves, "draw": print, **wrong}
        with pytest.raises(RegistryError, match=next(iter(wrong)) if "name" not in wrong else "a/b"):
            REGISTRY.register(FigureKind(**whole))


def test_a_figure_from_outside_that_fails_costs_no_other_figure(tmp_path: Path) -> None:
    file = tmp_path / "broken.py"
    file.write_text(
        "from figure.registry import REGISTRY, FigureKind\n"
        "from figure.response_curves import ResponseCurves\n"
        "REGISTRY.register(FigureKind(name='broken', draws=ResponseCurves, draw=lambda of: 1 / 0))\n"
    )
    REGISTRY.load(file)
    try:
        with pytest.warns(InputWarning, match=r'broken\.py, line 3: the figure "broken" .*ZeroDivisionError'):
            drawn = pictures({"response": EXAMPLES[ResponseCurves]()})
    finally:
        REGISTRY.forget(file)
    assert list(drawn) == ["response"]


def test_without_figures_from_outside_nothing_is_said() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", InputWarning)
        assert list(pictures({"x_response": EXAMPLES[ResponseCurves]()})) == ["x_response"]


@pytest.mark.parametrize("width", [5.6, 11.2])
def test_a_long_title_stays_within_its_figure(width: float) -> None:
    figure = make_figure(width, 4.0)
    add_heading(figure, TitledFigure(title="A beam with a dry joint, calibrated: force-displacement loops"))
    title = figure.texts[0].get_window_extent(FigureCanvasAgg(figure).get_renderer())
    assert title.x1 < figure.bbox.x1
