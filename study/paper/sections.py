"""Sections of the pages of the calibration by hand: linear and nonlinear iterations, their scores, intervals."""

from collections.abc import Iterator, Mapping, Sequence
from math import degrees, isfinite

from study.page.section import PageSection
from study.page.table import Table
from study.paper.by_hand import ByHand
from study.paper.case import LinearTable, NonlinearTable
from study.paper.criteria import COVERAGE, DYNAMIC, STATIC_NORMAL, STATIC_TANGENTIAL, Criterion
from study.paper.frequency_error import ROOT_DEVIATION
from study.paper.nonlinear import NonlinearIteration
from study.paper.parameters import RigParameters

#: What each iteration changes, in the words of the paper's section 4.3.
STEP = {
    1: "kt and kn of the linear calibration, mu of the first guess; the alignment as the case has it, which is perfect "
    "symmetry in the paper.",
    2: "Dead weights shifted by the ratio of the static normal forces, where they were measured; then kt, kn and mu "
    "tuned to the response.",
    3: "All of these and the inclinations of the dead weights fitted together, to the response and all forces.",
    4: "The left damper rotated by 0.35 deg: gaps that grow along its line at the blade.",
}
#: Columns of parameters.
COLUMNS = (
    "kt [N/um]", "kn [N/um]", "mu", "shifts [mm]", "inclinations [deg]", "rotation [deg]",
)  # fmt: skip
#: Label and factor of each parameter.
SHOWN = {
    "kt": ("kt [N/um]", 1e-6), "kn": ("kn [N/um]", 1e-6), "mu": ("mu [-]", 1.0), "damping": ("zeta [%]", 100.0),
    "root": ("root [N/um]", 1e-6), "density": ("density [kg/m^3]", 1.0), "shift_left": ("left shift [mm]", 1e3),
    "shift_right": ("right shift [mm]", 1e3), "inclination_left": ("left inclination [deg]", degrees(1.0)),
    "inclination_right": ("right inclination [deg]", degrees(1.0)),
}  # fmt: skip


def make_linear_section(
    hand: ByHand, title: str, pictures: Mapping[str, bytes], printed: Sequence[LinearTable] = ()
) -> PageSection:
    """The linear iterations; with printed values also their result on this rig."""
    free, stuck = hand.linear.free, hand.linear.stuck
    rows = []
    for number, item in enumerate(hand.linear.iterations, start=1):
        paper = printed[number - 1] if printed else None
        fits = [("as printed", item.start), ("here", item.own)] if paper else [("", item.own)]
        for name, fit in fits:
            p = fit.parameters
            row = [
                f"{number}, {name}".removesuffix(", "), "full" if p.root is None else "relaxed",
                "nominal" if p.density is None else f"{p.density:.0f} kg/m^3",
                f"{1e-6 * p.kt:.3g}", f"{1e-6 * p.kn:.3g}", f"{100 * p.damping:.2f}", f"{fit.free.frequency:.2f}",
                f"{100 * fit.free.damping:.2f}", f"{fit.stuck.frequency:.2f}", f"{100 * fit.stuck.damping:.2f}",
                f"{format_met(fit.free_met)} / {format_met(fit.stuck_met)}",
            ]  # fmt: skip
            rows.append([*row, f"{format_met(paper.free)} / {format_met(paper.stuck)}"] if paper else row)
    head = [
        "iteration", "root", "density", "kt [N/um]", "kn [N/um]", "zeta [%]", "free [Hz]", "its zeta [%]", "stuck [Hz]",
        "its zeta [%]", "met: free / stuck",
    ]  # fmt: skip
    alone = "not" if free is None else f"{free.frequency:.2f} Hz, {100 * free.damping:.2f} %"
    given = " Each iteration is given with the printed values and with those that its step gives on this rig."
    return PageSection(
        title=title,
        text=[
            f"Measured: free blade {alone}; with dampers at the lowest level {stuck.frequency:.2f} Hz, "
            f"{100 * stuck.damping:.2f} %." + (given if printed else "")
        ],
        tables=[Table(head=[*head, "in the paper"] if printed else head, rows=rows, words=3)],
        pictures=pictures,
    )


def make_overview_section(hand: ByHand, title: str, printed: Sequence[NonlinearTable] = ()) -> PageSection:
    """Parameters and criteria of the nonlinear iterations, with those that the paper prints above each."""
    rows = []
    for item in hand.nonlinear.iterations:
        if printed:
            paper = printed[item.number - 1]
            rows.append(
                [
                    f"{item.number}, paper",
                    *numbers(paper),
                    format_met(paper.response),
                    format_met(paper.force),
                ]
            )
        name = f"{item.number}, here" if printed else str(item.number)
        rows.append([name, *numbers(item.parameters), format_met(item.response.met), format_met(item.force.met)])
    return PageSection(
        title=title,
        text=["Shifts are positive away from the blade, inclinations towards the right; left / right."],
        tables=[Table(head=["iteration", *COLUMNS, "response met", "force met"], rows=rows)],
    )


def make_iteration_section(item: NonlinearIteration, pictures: Mapping[str, bytes]) -> PageSection:
    """One nonlinear iteration with its scores and pictures."""
    return PageSection(
        title=f"Iteration {item.number}", text=[STEP[item.number]], tables=[_make_scores_table(item)], pictures=pictures
    )


def make_interval_section(hand: ByHand, truth: Mapping[str, float | None] | None = None) -> PageSection:
    """Calibrated values with their intervals; with the truth also whether an interval contains it."""
    rows, held = [], []
    for item in hand.intervals:
        label, factor = SHOWN[item.name]
        ends = [f"{factor * value:.4g}" for value in (item.value, item.lower, item.upper)]
        row = [label, ends[0], f"{ends[1]} to {ends[2]}", item.source]
        true = None if truth is None else truth[item.name]
        if truth is not None:
            held += [] if true is None else [item.holds(true)]
            row += ["", ""] if true is None else [f"{factor * true:.4g}", format_met(item.holds(true))]
        rows.append(row)
    text = [
        "95 % intervals. Parameters that are fitted to families have the interval within which the profile of the "
        "criterion (the other parameters of the same fit free) rises by less than 1.92, as the logarithm of a "
        "likelihood would, with limits that are linear in the parameters; where the families do not determine a "
        "parameter, its interval is as wide as the prior of the fit.",
    ]
    names = {item.name for item in hand.intervals}
    resonances = "The damping ratio follows from the stuck resonance by least squares" + (
        ", and the density from the free one." if "density" in names else "."
    )
    unsure = "kt and the density are" if "density" in names else "kt is"
    root = hand.last.parameters.root is not None
    text.append(
        f"{resonances} {unsure} as sure as the frequencies of the model: numerical error"
        + (f", and {ROOT_DEVIATION:.0%} of assumed springs of the root, are part of it." if root else " is part of it.")
    )
    if held:
        text.append(f"{sum(held)} of {len(held)} intervals contain the truth.")
    head = ["parameter", "value", "interval", "by", *(("truth", "held") if truth is not None else ())]
    return PageSection(title="Intervals", text=text, tables=[Table(head=head, rows=rows)])


def make_missing_section(missing: Sequence[str]) -> Iterator[PageSection]:
    """What the campaign lacks, if anything."""
    if missing:
        yield PageSection(title="What this campaign cannot show", text=missing)


def numbers(parameters: RigParameters | NonlinearTable) -> list[str]:
    """Contact parameters, and those of the alignment, left and right."""
    lengths = " / ".join(f"{1e3 * getattr(parameters, f'shift_{side}'):.2f}" for side in ("left", "right"))
    angles = " / ".join(f"{degrees(getattr(parameters, f'inclination_{side}')):.2f}" for side in ("left", "right"))
    contact = [f"{1e-6 * parameters.kt:.3f}", f"{1e-6 * parameters.kn:.3f}", f"{parameters.mu:.3f}"]
    return [*contact, lengths, angles, f"{degrees(parameters.gap_angle):.2f}"]


def _make_scores_table(item: NonlinearIteration) -> Table:
    """Scores of both criteria by level; for forces the worst of all lines."""
    names: dict[str, Criterion] = {COVERAGE: item.response} | {
        name: item.force
        for name in (STATIC_NORMAL, STATIC_TANGENTIAL, DYNAMIC)
        if any(score.name == name for score in item.force.scores)
    }
    verdicts = {verdict.family.level: verdict for verdict in item.limits.response}
    rows = []
    for name, criterion in names.items():
        own = {
            level: [score for score in criterion.scores if score.name == name and score.level == level]
            for level in verdicts
        }
        worst = [
            (min if name == COVERAGE else max)((score.value for score in scores), default=float("nan"))
            for scores in own.values()
        ]
        threshold = next(score.threshold for score in criterion.scores if score.name == name)
        bound = "at least" if name == COVERAGE else "at most"
        met = all(score.met for scores in own.values() for score in scores)
        rows.append([name, *(show_known(value, ".1%") for value in worst), f"{bound} {threshold:.0%}", format_met(met)])
    rows.append(["tightness of the response", *(show_known(v.tightness, ".1f") for v in verdicts.values()), "", ""])
    rows.append(["interval score of the response", *(show_known(v.score, ".2f") for v in verdicts.values()), "", ""])
    return Table(head=["", *(f"{level:g} N" for level in verdicts), "threshold", "met"], rows=rows)


def show_known(value: float, form: str) -> str:
    """A formatted number; a dash if it is not finite."""
    return f"{value:{form}}" if isfinite(value) else "-"


def format_met(met: bool | None) -> str:
    """A criterion in a word."""
    return {True: "yes", False: "no", None: "not judged"}[met]
