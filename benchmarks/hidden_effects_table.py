"""Score of the hidden-effect test in Markdown, and its confusion matrix as a picture."""

import math

from benchmarks.hidden_effects_confusion import ELSEWHERE, Confusion
from benchmarks.hidden_effects_plan import EXCLUDED, KIND, PLANTED, ROWS
from benchmarks.hidden_effects_score import POOLED, Score, Share
from figure.confusion import ConfusionMatrix, draw_confusion_matrix
from figure.style import png
from transient.virtual_bench.effect import NOTHING

WORDS = {
    **KIND,
    NOTHING: "nothing",
    "cubic_excluded": "cubic, left out with its group",
    "air_damping_excluded": "air damping, left out with its group",
    "stop": "stop, never known",
    POOLED: "all of these",
}


def markdown(score: Score) -> str:
    """All tables of the score in Markdown."""
    parts = [_planted(score), _strengths(score), _rest(score), _matrix(score.confusion), _notes(score)]
    return "\n\n".join(parts) + "\n"


def picture(confusion: Confusion) -> bytes:
    """Confusion matrix as PNG."""
    rows = confusion.rows
    parted = [number for number, row in enumerate(rows) if number and row in (NOTHING, EXCLUDED[0])]
    right, total = int(confusion.count[confusion.right].sum()), int(confusion.count.sum())
    matrix = ConfusionMatrix(
        count=confusion.count,
        right=confusion.right,
        rows=[WORDS[row] for row in rows],
        columns=confusion.columns,
        gaps=(parted, [confusion.columns.index(ELSEWHERE)]),
        title="Hidden effects: planted and named",
        subtitle=f"{total} campaigns of the virtual test bench; the verdict is as it should be in {right} (blue)",
    )
    return png(draw_confusion_matrix(matrix))


def told(share: Share) -> str:
    """Fraction with its confidence interval in percent."""
    if not share.of:
        return "-"
    low, high = (100 * item for item in share.interval)
    return f"{share.count} of {share.of}, {100 * share.value:.0f} % ({low:.0f} to {high:.0f})"


def _planted(score: Score) -> str:
    lines = [
        "| planted | it or its group first | itself first, where it has no group | named by the verdict "
        "| only others named |",
        "|---|---|---|---|---|",
    ]
    for row in (*PLANTED, POOLED):
        of = score.planted[row]
        lines.append(f"| {WORDS[row]} | {told(of.first)} | {told(of.itself)} | {told(of.named)} | {told(of.wrong)} |")
    return "\n".join(lines)


def _strengths(score: Score) -> str:
    lines = [
        "| planted | strength within 15 %, of those with a predicted deviation to 5 % | true strength in the interval "
        "told | excess held-out error, after / before: median | at most half | of all together | excess held-out "
        "chi^2, of all together |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in (*PLANTED, POOLED):
        of, excess = score.planted[row], score.planted[row].excess
        lines.append(
            f"| {WORDS[row]} | {told(of.strength)} | {told(of.covered)} | {_number(excess.median)} | "
            f"{told(Share(count=excess.halved, of=excess.seen))} | {_number(excess.together)} | "
            f"{_number(excess.weighed)} |"
        )
    return "\n".join(lines)


def _rest(score: Score) -> str:
    lines = [
        "| not in the catalogue | fourth verdict | place right | both | exponent, median |",
        "|---|---|---|---|---|",
    ]
    for row in (*EXCLUDED, POOLED):
        of = score.excluded[row]
        lines.append(
            f"| {WORDS[row]} | {told(of.unknown)} | {told(of.place)} | {told(of.both)} | {_number(of.exponent)} |"
        )
    return f"Nothing planted: a claim in {told(score.claims)}.\n\n" + "\n".join(lines)


def _matrix(confusion: Confusion) -> str:
    lines = [f"| planted | {' | '.join(confusion.columns)} |", "|---" * (len(confusion.columns) + 1) + "|"]
    for row, counts, right in zip(confusion.rows, confusion.count, confusion.right, strict=True):
        cells = [f"**{n}**" if n and good else str(n or "") for n, good in zip(counts, right, strict=True)]
        lines.append(f"| {WORDS[row]} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _notes(score: Score) -> str:
    of = int(score.confusion.count.sum())
    missing = [WORDS[row] for row in ROWS if row not in score.confusion.rows]
    lines = [
        f"{of} campaigns; {score.seconds[0]:.0f} s of processor time each in the median, 95 % below "
        f"{score.seconds[1]:.0f} s (made: {score.make_seconds[0]:.0f} and {score.make_seconds[1]:.0f} s).",
        f"The floor of the held-out error is {_number(score.floor_factor)} times what the covariance leads to "
        "expect, the median where nothing is planted.",
    ]
    if score.failed:
        lines.append(f"{score.failed} failed, and count as wrong.")
    if missing:
        lines.append(f"Not run: {', '.join(missing)}.")
    if len(score.code) > 1:
        lines.append(f"**Results of {len(score.code)} versions of the code are mixed: {', '.join(score.code)}.**")
    return "\n".join(lines)


def _number(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "-"
