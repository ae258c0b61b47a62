"""Candidate effects: decrease of chi-squared by each, and the held-out error with it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from figure.registry import draws
from figure.style import INK, PALE, Figure, TitledFigure, add_heading, add_legend, make_figure, open_box

#: Colours of candidates named by the verdict, fitted, and to first order only.
NAMED, FITTED, EXPECTED = "#c2410c", "#1f4e79", "#c3ced9"


@dataclass(frozen=True, kw_only=True)
class CandidateBar:
    """Bar of one candidate.

    Parameters
    ----------
    name
        Name of the effect.
    gain
        Fall of chi-squared [-].
    is_fitted
        Whether it was fitted, not only scored to first order.
    is_named
        Whether the verdict names it.
    held_out
        Held-out error with it [-]; None if it was not fitted, NaN if it is unknown.
    strength
        Strength in words.
    """

    name: str
    gain: float
    is_fitted: bool
    is_named: bool
    held_out: float | None
    strength: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Candidates(TitledFigure):
    """Candidate effects of a diagnosis.

    Parameters
    ----------
    candidates
        Best first.
    threshold
        99 % null quantile of the decrease [-].
    before
        Held-out error without any of them [-]; NaN if it is unknown.
    """

    candidates: Sequence[CandidateBar]
    threshold: float
    before: float
    subtitle: str


@draws(Candidates, "candidates")
def draw_candidates(result: Candidates) -> Figure:
    """Draw the candidates."""
    from matplotlib.patches import Patch

    n = len(result.candidates)
    figure = make_figure(11.5, 1.9 + 0.32 * n)
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=[1.5, 1.0])
    place = np.arange(n)[::-1]
    # A zero gain has no logarithm.
    least = min(1.0, result.threshold / 10)
    for at, item in zip(place, result.candidates, strict=True):
        colour = _colour(item)
        left.barh(at, max(item.gain, least), 0.7, color=colour, zorder=2)
        left.text(
            max(item.gain, least) * 1.15, at, item.strength, va="center", fontsize=8, color=INK, zorder=3,
            clip_on=False, bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none"},
        )  # fmt: skip
        if item.held_out is not None:
            right.plot(100 * item.held_out, at, "o", color=colour, markersize=6, zorder=3)
    left.set_xscale("log")
    most = max([item.gain for item in result.candidates] + [result.threshold])
    left.set_xlim(least, most * (most / least) ** 0.35)
    left.axvline(result.threshold, color=INK, linewidth=0.9, linestyle=(0, (4, 3)), zorder=1)
    left.set_xlabel("decrease of chi-squared [-], and strength")
    left.set_yticks(place, [item.name for item in result.candidates], fontsize=9)
    fitted = [item.held_out for item in result.candidates if item.held_out is not None]
    errors = np.array([result.before, *fitted])
    if np.isfinite(errors).any():
        right.axvline(100 * result.before, color=PALE, linewidth=0.9, linestyle=(0, (4, 3)))
        right.set_xlim(0, 1.12 * 100 * float(np.nanmax(errors)) or None)
    else:
        right.set_xticks([])
        right.text(0.5, 0.5, "unknown", transform=right.transAxes, ha="center", va="center", color=PALE)
    right.set_xlabel("held-out error [%]; dashed: without an effect")
    for axes in (left, right):
        open_box(axes, grid="x")
    colours = {_colour(item) for item in result.candidates}
    words = {NAMED: "named by the verdict", FITTED: "fitted", EXPECTED: "to first order"}
    handles = [Patch(color=colour, label=label) for colour, label in words.items() if colour in colours]
    add_legend(figure, handles, loc="outside lower left")
    add_heading(figure, result)
    return figure


def _colour(result: CandidateBar) -> str:
    return NAMED if result.is_named else FITTED if result.is_fitted else EXPECTED
