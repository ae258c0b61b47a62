"""The mesh study as a figure: how far each row is from the published one, and how both element types converge."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from figure.style import add_title, open_box, png
from study.table1.study import MeshStudy, StudyRow

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Colours that stay apart for colour-blind readers (Okabe and Ito, 2008).
LINEAR, QUADRATIC, GREY = "#d55e00", "#0072b2", "#6b7280"
COLOUR = {"hex8": LINEAR, "hex20": QUADRATIC}
NAME = {"hex8": "8-node", "hex20": "20-node"}
#: Rows should be this near the published ones [Hz].
AIM = 0.3


def mesh_study_figure(study: MeshStudy) -> bytes:
    """Draw the figure as PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.5, 4.8), layout="constrained", dpi=160)
    errors, convergence = figure.subplots(1, 2, width_ratios=(1.15, 1))
    _draw_errors(errors, [row for row in study.rows if row.error is not None])
    _draw_convergence(convergence, study)
    add_title(figure, f"{study.case.title}: first natural frequency")
    for axes in (errors, convergence):
        open_box(axes, grid="y")
    return png(figure)


def _draw_errors(axes: "Axes", rows: Sequence[StudyRow]) -> None:
    axes.axhspan(-AIM, AIM, color="#f3f4f6", zorder=0)
    axes.axhline(0, color=GREY, linewidth=1)
    for place, row in enumerate(rows):
        colour = COLOUR[row.asked.element]
        face = colour if row.asked.root == "full" else "white"
        axes.vlines(place, 0, row.error or 0.0, color=colour, linewidth=1.5)
        axes.plot(place, row.error or 0.0, "o", color=colour, markerfacecolor=face, markersize=8)
    axes.set_xticks(
        range(len(rows)),
        [f"{row.asked.model}\n{row.asked.element}\nn = {row.asked.elements_through_thickness}" for row in rows],
    )
    axes.tick_params(axis="x", length=0)
    reach = 1.35 * max([AIM, *(abs(row.error or 0.0) for row in rows)])
    axes.set_ylim(-reach, reach)
    axes.set_ylabel("this model minus the paper [Hz]")
    axes.set_title(f"Ten rows; grey: within {AIM} Hz; filled: full clamp, open: relaxed", fontsize=10, loc="left")


def _draw_convergence(axes: "Axes", study: MeshStudy) -> None:
    from matplotlib.ticker import MaxNLocator

    full = [row for row in study.rows if row.asked.root == "full"]
    for element, colour in COLOUR.items():
        ours = sorted(
            (row.asked.elements_through_thickness, float(row.result.frequency[0]))
            for row in full
            if row.asked.element == element
        )
        untuned = [
            (each.asked.elements_through_thickness, each)
            for each in study.predictions
            if each.asked.element == element and each.asked.thickness_factor == 1
        ]
        line = sorted([*ours, *((n, each.result.frequency) for n, each in untuned)])
        if line:
            axes.plot(*zip(*line, strict=True), "-", color=colour, linewidth=1.2, alpha=0.6)
        if ours:
            axes.plot(*zip(*ours, strict=True), "o", color=colour, markersize=7, label=f"{NAME[element]}, in the table")
        if untuned:
            points = [(n, each.result.frequency) for n, each in untuned]
            axes.plot(
                *zip(*points, strict=True),
                "o",
                color=colour,
                markerfacecolor="white",
                markersize=7,
                label=f"{NAME[element]}, not tuned to",
            )
            theory = [(n, each.theory) for n, each in untuned]
            axes.plot(
                *zip(*theory, strict=True), "_", color="black", markersize=16, label="closed form of parasitic shear"
            )
    published = {(row.asked.elements_through_thickness, row.asked.paper) for row in full if row.asked.paper is not None}
    if published:
        axes.plot(*zip(*sorted(published), strict=True), "x", color="black", markersize=6, label="paper")
    axes.axhline(study.case.measured, color=GREY, linewidth=1, linestyle="--", label="measured")
    axes.set_xlabel("elements through the thickness, n")
    axes.set_ylabel("first frequency [Hz]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(frameon=False, fontsize=9)
    axes.set_title("Full clamp: the 8-node brick locks by parasitic shear", fontsize=10, loc="left")
