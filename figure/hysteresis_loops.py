"""Contact forces at the highest point of each curve: friction loops, and both forces over one period."""

from collections.abc import Sequence
from dataclasses import dataclass

from figure.period_axis import Samples, closed
from figure.registry import draws
from figure.style import (
    LONGEST_LEGEND,
    Axes,
    Figure,
    TitledFigure,
    add_title,
    choose_family_colours,
    make_figure,
    open_box,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class HysteresisLoop:
    """Hysteresis loop of one joint over one period.

    Parameters
    ----------
    label
        Label of the curve of the motion.
    time
        Share of the period, shape (n,) [-].
    displacement
        Along the first direction, shape (n,) [m].
    force
        Along it, shape (n,) [N].
    normal
        Normal force, shape (n,) [N]; None for a joint without one.
    is_stop
        Whether the force itself is a normal force.
    """

    label: str
    time: Samples
    displacement: Samples
    force: Samples
    normal: Samples | None
    is_stop: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class HysteresisLoops(TitledFigure):
    """Motions and forces of joints over one period.

    Parameters
    ----------
    joints
        Name of each joint, and its motion on each curve.
    """

    joints: Sequence[tuple[str, Sequence[HysteresisLoop]]]
    title: str


@draws(HysteresisLoops, "hysteresis_loops")
def draw_hysteresis(result: HysteresisLoops) -> Figure:
    """Draw the loops."""
    has_normal = any(loop.normal is not None for _, loops in result.joints for loop in loops)
    columns = 3 if has_normal else 2
    figure = make_figure(3.9 * columns, 0.9 + 3.1 * len(result.joints))
    grid = figure.subplots(len(result.joints), columns, squeeze=False)
    for row, (name, loops) in enumerate(result.joints):
        for loop, colour in zip(loops, choose_family_colours(len(loops)), strict=True):
            _draw(grid[row], loop, colour)
        grid[row, 0].set_title(f"{name}: loop", fontsize=10, loc="left")
        grid[row, 0].set_xlabel("displacement [µm]")
        grid[row, 0].set_ylabel("force [N]")
        is_stop = any(loop.is_stop for loop in loops)
        kind = "normal force" if is_stop else "force"
        grid[row, 1].set_title(f"{kind} over one period", fontsize=10, loc="left")
        grid[row, 1].set_ylabel("N(t) [N]" if is_stop else "T(t) [N]" if has_normal else "force [N]")
        if has_normal and any(loop.normal is not None for loop in loops):
            grid[row, 2].set_title("normal force over one period", fontsize=10, loc="left")
            grid[row, 2].set_ylabel("N(t) [N]")
        elif has_normal:
            grid[row, 2].set_visible(False)
        for axes in grid[row, 1:]:
            axes.set_xlabel("time / period [-]")
            axes.set_xlim(0, 1)
    for axes in grid.flat:
        open_box(axes)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), LONGEST_LEGEND), frameon=False)
    add_title(figure, result.title)
    return figure


def _draw(row: Sequence[Axes], loop: HysteresisLoop, colour: str) -> None:
    _, displacement = closed(loop.time, loop.displacement)
    time, force = closed(loop.time, loop.force)
    row[0].plot(displacement * 1e6, force, color=colour, linewidth=1.4, label=loop.label)
    row[1].plot(time, force, color=colour, linewidth=1.4)
    if loop.normal is not None:
        row[2].plot(*closed(loop.time, loop.normal), color=colour, linewidth=1.4)
