"""Numbers in sentences."""

import pytest

from geometry.plain_number import count, format_number, percent


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(137.2, 2, "140"), (-178.6, 2, "-180"), (0.3604, 2, "0.36"), (1234.5, 3, "1230"), (99.7, 2, "100"), (0.0, 2, "0")],
)
def test_percents_and_degrees_have_no_exponent(value: float, digits: int, text: str) -> None:
    assert format_number(value, digits) == text


@pytest.mark.parametrize(
    ("share", "said"), [(0.0412, "4.1 %"), (1.373, "140 %"), (float("nan"), "unknown"), (float("inf"), "unknown")]
)
def test_a_share_is_in_per_cent_and_one_that_is_none_is_unknown(share: float, said: str) -> None:
    assert percent(share) == said


@pytest.mark.parametrize(("number", "words"), [(0, "0 joints"), (1, "1 joint"), (1234, "1,234 joints")])
def test_a_number_of_things_has_its_noun_in_the_right_form(number: int, words: str) -> None:
    assert count(number, "joint") == words
