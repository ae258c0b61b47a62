"""Confusion matrix: counts by planted and by named effect, shaded by the share of their row."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int
from numpy.typing import NDArray

from figure.registry import draws
from figure.style import INK, PALE, Axes, Figure, TitledFigure, add_heading, make_figure

#: Shades from no campaign to all of a row: correct cells in blue, wrong ones in red.
RIGHT = ("#eef2f6", "#0b5394")
WRONG = ("#eef2f6", "#a11a14")
#: Share from which on a shade is dark enough for white ink.
DARK = 0.45
#: Inches of a cell.
WIDTH, HEIGHT = 0.72, 0.42


@dataclass(frozen=True, kw_only=True, eq=False)
class ConfusionMatrix(TitledFigure):
    """Counts by planted and by named effect.

    Parameters
    ----------
    count
        Cases, shape (r, c).
    right
        Cells with a correct verdict, shape (r, c).
    rows, columns
        Planted and named effects, in words.
    gaps
        Rows and columns before which a line divides the matrix.
    """

    count: Int[NDArray[np.int64], "r c"]
    right: Bool[NDArray[np.bool_], "r c"]
    rows: Sequence[str]
    columns: Sequence[str]
    gaps: tuple[Sequence[int], Sequence[int]] = ((), ())
    subtitle: str


@draws(ConfusionMatrix, "confusion")
def draw_confusion_matrix(result: ConfusionMatrix) -> Figure:
    """Draw the matrix."""
    longest = max(len(row) for row in result.rows)
    figure = make_figure(1.5 + 0.085 * longest + WIDTH * len(result.columns), 2.5 + HEIGHT * len(result.rows))
    axes = figure.subplots()
    total = result.count.sum(axis=1, keepdims=True)
    share = result.count / np.maximum(total, 1)
    axes.imshow(_choose_shades(share, result.right), aspect="auto", interpolation="nearest")
    for (i, j), number in np.ndenumerate(result.count):
        if number:
            axes.text(
                j, i, str(number), ha="center", va="center", fontsize=10, color="white" if share[i, j] > DARK else INK,
                fontweight="bold" if result.right[i, j] else "normal",
            )  # fmt: skip
    axes.set_xticks(
        range(len(result.columns)), result.columns, rotation=35, ha="left", rotation_mode="anchor", fontsize=9
    )
    axes.set_yticks(
        range(len(result.rows)), [f"{row}  ({n})" for row, (n,) in zip(result.rows, total, strict=True)], fontsize=9
    )
    axes.xaxis.tick_top()
    axes.xaxis.set_label_position("top")
    axes.set_xlabel("named by the verdict", fontsize=10, color=PALE, loc="left")
    axes.set_ylabel("planted (campaigns)", fontsize=10, color=PALE)
    _draw_grid(axes, result.count.shape, result.gaps)
    add_heading(figure, result)
    return figure


def _choose_shades(share: NDArray[np.float64], right: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Colours, shape (r, c, 3); roots of shares, so that a single case shows."""
    from matplotlib.colors import LinearSegmentedColormap

    shades = [LinearSegmentedColormap.from_list(name, ends) for name, ends in (("right", RIGHT), ("wrong", WRONG))]
    as_it_should, as_not = (np.asarray(shade(share**0.7))[..., :3] for shade in shades)
    return np.where(right[..., None], as_it_should, as_not)


def _draw_grid(axes: Axes, shape: tuple[int, ...], gaps: tuple[Sequence[int], Sequence[int]]) -> None:
    """White lines between the cells, dark ones where the matrix is divided."""
    axes.set_xticks(np.arange(shape[1] + 1) - 0.5, minor=True)
    axes.set_yticks(np.arange(shape[0] + 1) - 0.5, minor=True)
    axes.grid(which="minor", color="white", linewidth=1.5)
    axes.tick_params(which="both", length=0, colors=INK)
    axes.spines[:].set_visible(False)
    for row in gaps[0]:
        axes.axhline(row - 0.5, color=PALE, linewidth=1.0)
    for column in gaps[1]:
        axes.axvline(column - 0.5, color=PALE, linewidth=1.0)
