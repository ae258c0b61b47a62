"""Where two curves differ is told by neighbouring frequencies that both have."""

import numpy as np

from correlation.campaign.passes import find_difference

FREQUENCY = np.arange(10.0)


def test_curves_differ_between_two_frequencies_by_a_factor() -> None:
    size = np.where((FREQUENCY >= 4) & (FREQUENCY <= 7), 2.0, 1.0)
    for one, other in ((size, np.ones(10)), (np.ones(10), size)):
        assert find_difference(FREQUENCY, one, FREQUENCY, other) == (4.0, 7.0, 2.0)


def test_curves_do_not_differ_at_two_frequencies_or_where_one_has_none() -> None:
    size = np.where((FREQUENCY >= 4) & (FREQUENCY <= 5), 2.0, 1.0)
    assert find_difference(FREQUENCY, size, FREQUENCY, np.ones(10)) is None
    assert find_difference(FREQUENCY, np.full(10, 2.0), FREQUENCY + 8, np.ones(10)) is None
    assert find_difference(FREQUENCY, size, np.zeros(0), np.zeros(0)) is None
