"""A force between its samples."""

import numpy as np
import pytest

from correlation.time_record.prediction import REACH, compensate_interpolation, refine


@pytest.mark.parametrize("factor", [1, 2, 8])
def test_the_samples_themselves_stay(factor: int) -> None:
    values = np.random.default_rng(1).normal(size=200)
    fine = refine(values, factor)
    assert len(fine) == 199 * factor + 1
    # The kernel is 1 at its middle and 0 at the other samples, to round-off of the sine there.
    np.testing.assert_allclose(fine[::factor], values, atol=1e-13)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_sine_below_half_the_sampling_rate_is_interpolated(share: float) -> None:
    angle = np.pi * share * np.arange(400) + 0.7
    fine = refine(np.sin(angle), 4)
    exact = np.sin(np.pi * share * np.arange(len(fine)) / 4 + 0.7)
    inside = slice(4 * REACH, -4 * REACH)
    # Kaiser's window of parameter 8 lets 1e-4 pass; at 0.9 of the band the kernel's slope begins.
    np.testing.assert_allclose(fine[inside], exact[inside], atol=2e-4)


def test_a_constant_stays_to_the_ends() -> None:
    # The window's ripple acts on what differs from the first value alone.
    np.testing.assert_allclose(refine(np.full(50, 3.5), 8), 3.5, rtol=1e-15)


def test_straight_lines_act_like_the_curve_to_fourth_order() -> None:
    # Their fundamental is sinc^2(angle / 2) of the nodes'.
    left = []
    for angle in (0.2, 0.1):
        nodes = compensate_interpolation(np.sin(angle * np.arange(50)))[5:-5] / np.sin(angle * np.arange(50))[5:-5]
        left.append(abs(nodes[1] * np.sinc(angle / (2 * np.pi)) ** 2 - 1))
    # 2^4, but for terms of sixth order.
    assert left[0] / left[1] == pytest.approx(16, rel=0.05)
