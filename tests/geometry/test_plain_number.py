"""Numbers in sentences."""

import pytest

from geometry.plain_number import plain


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(137.2, 2, "140"), (-178.6, 2, "-180"), (0.3604, 2, "0.36"), (1234.5, 3, "1230"), (99.7, 2, "100"), (0.0, 2, "0")],
)
def test_percents_and_degrees_have_no_exponent(value: float, digits: int, text: str) -> None:
    assert plain(value, digits) == text
