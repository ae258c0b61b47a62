"""Numbers of the falling error stand on their bars, and none on the line of the noise."""

from dataclasses import replace

import numpy as np
import pytest

from figure.candidates import Candidates, draw_candidates
from figure.style import png
from figure.waterfall import LABEL, NOISE_CHI2, Waterfall, draw_waterfall, label_foot
from tests.figure.examples import EXAMPLES


@pytest.mark.parametrize("value", [0.31, 0.5, 0.6, 0.75, 0.822, 0.99, 1.0, 1.02, 7850.0])
@pytest.mark.parametrize("highest", [4.4, 2e4])
def test_no_number_lies_on_the_line_of_the_noise(value: float, highest: float) -> None:
    lowest = 0.3
    foot = label_foot(value, lowest, highest)
    top = foot * (highest / lowest) ** LABEL
    assert foot >= value
    assert not foot < NOISE_CHI2 < top
    if value >= NOISE_CHI2:
        assert foot == value


def test_a_number_far_below_the_noise_stands_on_its_bar() -> None:
    assert label_foot(0.31, 0.3, 4.4) == 0.31


@pytest.mark.parametrize("known", [0, 1])
def test_an_error_that_is_not_known_is_said_to_be_unknown(known: int) -> None:
    """As where repeats differ by as much as they read; with some known errors the axis is of these."""
    steps: Waterfall = EXAMPLES[Waterfall]()
    unknown = [replace(step, training=np.nan, held_out=np.nan) for step in steps.steps]
    figure = draw_waterfall(replace(steps, steps=[*steps.steps[:known], *unknown[known:]]))
    assert png(figure)
    words = [text.get_text() for text in figure.axes[0].texts]
    assert words.count("unknown") == 2 * (len(unknown) - known)
    assert "nan" not in words

    bars: Candidates = EXAMPLES[Candidates]()
    nothing = [replace(item, held_out=None if item.held_out is None else np.nan) for item in bars.candidates]
    candidates = [*bars.candidates[:known], *nothing[known:]]
    drawn = draw_candidates(replace(bars, candidates=candidates, before=np.nan))
    assert png(drawn)
    assert [text.get_text() for text in drawn.axes[1].texts] == ["unknown"] * (1 - known)
