"""Richardson's extrapolation: exact where its assumption holds, refused or warned of where it does not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from geometry.errors import InputError
from study.table1.stages import Limit, richardson


@given(
    limit=st.floats(50, 500),
    share=st.floats(1e-3, 0.2),
    order=st.floats(0.5, 6),
    ratio=st.sampled_from([1.5, 2.0, 3.0]),
    sign=st.sampled_from([-1.0, 1.0]),
)
def test_an_error_that_is_a_power_of_the_size_is_taken_out_exactly(
    limit: float, share: float, order: float, ratio: float, sign: float
) -> None:
    frequencies = [limit * (1 + sign * share * ratio ** (-order * level)) for level in range(3)]
    result = richardson(frequencies, ratio, 2)
    # Differences of 1e-3 and, at order 6 and ratio 3, 1e-6 of it: ten digits less than the sixteen there are.
    assert result.frequency == pytest.approx(limit, rel=1e-9)
    assert result.order == pytest.approx(order, abs=1e-4)


@pytest.mark.parametrize(
    "frequencies",
    [
        [122.0, 121.9, 121.7],  # steps grow
        [122.0, 121.9, 121.8],  # steps do not shrink
        [122.0, 121.9, 121.95],  # to and fro
        [122.0, 122.0, 122.0],  # no step at all
        [122.0, 121.9, 121.9],
    ],
)
def test_frequencies_without_a_limit_are_refused_with_their_values(frequencies: list[float]) -> None:
    with pytest.raises(
        InputError, match=r"frequencies 122, .* Hz of the nested meshes do not converge: start from a f"
    ):
        richardson(frequencies, 2.0, 2)


@pytest.mark.parametrize(
    ("order", "theory", "warned"), [(1.0, 4, True), (2.9, 4, True), (3.1, 4, False), (1.6, 2, False)]
)
def test_an_order_far_from_theory_is_warned_of(order: float, theory: int, warned: bool) -> None:
    warning = Limit(frequency=120.0, order=order, theory=theory).warning
    assert (f"observed order {order:.2f} is far below {theory}" in warning) == warned
    assert bool(warning) == warned


def test_theory_is_twice_the_degree() -> None:
    assert [richardson([4.0, 2.0, 1.0], 2.0, degree).theory for degree in (1, 2)] == [2, 4]
