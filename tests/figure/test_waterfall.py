"""Numbers of the falling error stand on their bars, and none on the line of the noise."""

import pytest

from figure.waterfall import LABEL, NOISE, label_foot


@pytest.mark.parametrize("value", [0.31, 0.5, 0.6, 0.75, 0.822, 0.99, 1.0, 1.02, 7850.0])
@pytest.mark.parametrize("highest", [4.4, 2e4])
def test_no_number_lies_on_the_line_of_the_noise(value: float, highest: float) -> None:
    lowest = 0.3
    foot = label_foot(value, lowest, highest)
    top = foot * (highest / lowest) ** LABEL
    assert foot >= value
    assert not foot < NOISE < top
    if value >= NOISE:
        assert foot == value


def test_a_number_far_below_the_noise_stands_on_its_bar() -> None:
    assert label_foot(0.31, 0.3, 4.4) == 0.31
