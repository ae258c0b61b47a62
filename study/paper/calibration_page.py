"""The page of a case that was calibrated by hand as in the paper."""

from collections.abc import Iterator, Mapping, Sequence

from study.estimate.first_estimate import FirstEstimate
from study.page.plain_page import render_plain_page
from study.page.section import PageSection
from study.page.table import Table
from study.paper.by_hand import ByHand
from study.paper.criteria import COVERAGE, STATIC_NORMAL
from study.paper.sections import (
    format_met,
    make_interval_section,
    make_iteration_section,
    make_linear_section,
    make_missing_section,
    make_overview_section,
)


def make_calibration_page(
    title: str, guesses: Sequence[FirstEstimate], hand: ByHand, missing: Sequence[str], pictures: Mapping[str, bytes]
) -> str:
    """HTML of a calibration.

    Parameters
    ----------
    title
        Title of the case.
    guesses
        First guesses that were taken.
    hand
        Iterations and intervals.
    missing
        What was not done and why, one sentence each.
    pictures
        PNG of each figure by name.
    """
    last = hand.last
    met = [item for item in (last.response.met, last.force.met) if item is not None]
    return render_plain_page(
        title=title,
        over="Calibrated by the manual procedure of Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024)",
        tone="nothing" if all(met) else "ambiguous",
        tag=f"iteration {last.number}: response {format_met(last.response.met)}, force {format_met(last.force.met)}",
        verdict=summarise(hand),
        sections=list(_sections(guesses, hand, missing, pictures)),
    )


def summarise(hand: ByHand) -> list[str]:
    """The calibration in a few sentences."""
    least = hand.last.response.worst(COVERAGE)
    sentences = [
        f"The limits of iteration {hand.last.number} cover at least {least.value:.1%} of the measured response "
        f"at every level (least at {least.level:g} N)."
    ]
    if any(score.name == STATIC_NORMAL for score in hand.last.force.scores):
        normal = hand.last.force.worst(STATIC_NORMAL)
        sentences.append(
            f"The largest deviation of a static normal force is {normal.value:.1%} (at {normal.level:g} N)."
        )
    return sentences


def _sections(
    guesses: Sequence[FirstEstimate], hand: ByHand, missing: Sequence[str], pictures: Mapping[str, bytes]
) -> Iterator[PageSection]:
    def find_pictures(caption: str, name: str) -> dict[str, bytes]:
        return {caption: pictures[name]} if name in pictures else {}

    yield from make_missing_section(missing)
    yield PageSection(
        title="First guesses",
        text=[]
        if guesses
        else ["There are no loops and no force ratios: iterations begin with the values of the case."],
        tables=[
            Table(
                head=["parameter", "first guess", "case", "source"],
                rows=[
                    [item.parameter, f"{item.value:.4g} {item.unit}", f"{item.model_value:.4g}", item.source]
                    for item in guesses
                ],
            )
        ]
        * bool(guesses),
    )
    yield make_linear_section(
        hand, "Linear calibration", find_pictures("Measured and computed responses of small vibrations", "linear")
    )
    yield make_overview_section(hand, "Nonlinear iterations")
    for item in hand.nonlinear.iterations:
        number = item.number
        response = find_pictures(f"Measured responses and predicted limits, iteration {number}", f"response_{number}")
        forces = find_pictures(
            f"Measured contact forces at resonance and predicted limits, iteration {number}", f"forces_{number}"
        )
        yield make_iteration_section(item, response | forces)
    yield make_interval_section(hand)
