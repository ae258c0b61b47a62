"""The mesh study as a figure: difference of each row from the published one, and convergence of both element types."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from figure.registry import draws
from figure.style import LIMITS, Axes, Figure, TitledFigure, add_title, make_figure, open_box

GREY = "#6b7280"
#: Of linear and quadratic elements.
COLOUR = {"hex8": LIMITS[1], "hex20": LIMITS[0]}
NAME = {"hex8": "8-node", "hex20": "20-node"}
#: Tolerance of the difference of rows from the published ones [Hz].
AIM = 0.3


@dataclass(frozen=True, kw_only=True)
class ModelFrequency:
    """First natural frequency of a model of the study.

    Parameters
    ----------
    element
        "hex8" or "hex20".
    through_thickness
        Elements through the thickness [-].
    frequency
        First natural frequency of this model [Hz].
    reference
        Frequency of the paper, or by the closed form for an untuned model [Hz]; None if there is none.
    number
        Number of the model in the table; None for an untuned model.
    is_full
        Whether the whole root is clamped.
    """

    element: str
    through_thickness: int
    frequency: float
    reference: float | None
    number: int | None = None
    is_full: bool = True


@dataclass(frozen=True, kw_only=True)
class MeshConvergence(TitledFigure):
    """First natural frequencies of one blade on several meshes.

    Parameters
    ----------
    rows
        Models of the table.
    untuned
        Untuned models, fully clamped.
    measured
        First natural frequency [Hz].
    """

    rows: Sequence[ModelFrequency]
    untuned: Sequence[ModelFrequency]
    measured: float
    title: str


@draws(MeshConvergence, "mesh_study")
def draw_mesh_study(result: MeshConvergence) -> Figure:
    """Draw the errors of the table next to the convergence."""
    figure = make_figure(11.5, 4.8)
    errors, convergence = figure.subplots(1, 2, width_ratios=(1.15, 1))
    _draw_errors(errors, result.rows)
    _draw_convergence(convergence, result)
    add_title(figure, result.title)
    for axes in (errors, convergence):
        open_box(axes, grid="y")
    return figure


def _draw_errors(axes: Axes, rows: Sequence[ModelFrequency]) -> None:
    axes.axhspan(-AIM, AIM, color="#f3f4f6", zorder=0)
    axes.axhline(0, color=GREY, linewidth=1)
    known = [(row, row.frequency - row.reference) for row in rows if row.reference is not None]
    for place, (row, error) in enumerate(known):
        colour = COLOUR[row.element]
        axes.vlines(place, 0, error, color=colour, linewidth=1.5)
        axes.plot(place, error, "o", color=colour, markerfacecolor=colour if row.is_full else "white", markersize=8)
    axes.set_xticks(
        range(len(known)), [f"{row.number}\n{row.element}\nn = {row.through_thickness}" for row, _ in known]
    )
    axes.tick_params(axis="x", length=0)
    reach = 1.35 * max([AIM, *(abs(error) for _, error in known)])
    axes.set_ylim(-reach, reach)
    axes.set_ylabel("this model minus the paper [Hz]")
    axes.set_title(f"Ten rows; grey: within {AIM} Hz; filled: full clamp, open: relaxed", fontsize=10, loc="left")


def _draw_convergence(axes: Axes, result: MeshConvergence) -> None:
    from matplotlib.ticker import MaxNLocator

    full = [row for row in result.rows if row.is_full]
    for element, colour in COLOUR.items():
        ours = sorted((row.through_thickness, row.frequency) for row in full if row.element == element)
        untuned = [row for row in result.untuned if row.element == element]
        free = [(row.through_thickness, row.frequency) for row in untuned]
        theory = [(row.through_thickness, row.reference) for row in untuned if row.reference is not None]
        style: dict[str, Any] = {"color": colour, "markersize": 7}
        if ours or free:
            axes.plot(*zip(*sorted([*ours, *free]), strict=True), "-", color=colour, linewidth=1.2, alpha=0.6)
        if ours:
            axes.plot(*zip(*ours, strict=True), "o", label=f"{NAME[element]}, in the table", **style)
        if free:
            label = f"{NAME[element]}, not used for tuning"
            axes.plot(*zip(*free, strict=True), "o", markerfacecolor="white", label=label, **style)
        if theory:
            label = "closed form of parasitic shear"
            axes.plot(*zip(*theory, strict=True), "_", color="black", markersize=16, label=label)
    published = {(row.through_thickness, row.reference) for row in full if row.reference is not None}
    if published:
        axes.plot(*zip(*sorted(published), strict=True), "x", color="black", markersize=6, label="paper")
    axes.axhline(result.measured, color=GREY, linewidth=1, linestyle="--", label="measured")
    axes.set_xlabel("elements through the thickness, n [-]")
    axes.set_ylabel("first frequency [Hz]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(frameon=False, fontsize=9)
    axes.set_title("Full clamp: the 8-node brick locks in parasitic shear", fontsize=10, loc="left")
