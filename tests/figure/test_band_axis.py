"""Bands that were measured apart stand side by side."""

import numpy as np
import pytest

from figure.band_axis import STRIP, join_bands, use_band_axis
from figure.style import add_axes, make_bare_figure

BANDS = [np.linspace(112.0, 154.0, 15), np.linspace(705.0, 735.0, 7)]


def place(frequencies: list[np.ndarray], wanted: list[float]) -> np.ndarray:
    """Places of frequencies along the axis, from 0 to 1."""
    figure = make_bare_figure(6, 3)
    axes = add_axes(figure, 1.0, 0.5, 4.0, 2.0)
    use_band_axis(axes, [np.concatenate(frequencies)])
    at = axes.transData.transform([(item, 0.0) for item in wanted])[:, 0]
    low, high = axes.transAxes.transform([(0.0, 0.0), (1.0, 0.0)])[:, 0]
    return (at - low) / (high - low)


def test_bands_are_as_wide_as_they_have_points_and_the_gap_is_a_strip() -> None:
    first, end, begin, last = place(BANDS, [112.0, 154.0, 705.0, 735.0])
    assert 0 < first < end < begin < last < 1
    assert (end - first) / (last - begin) == pytest.approx(15 / 7, rel=1e-6)  # margins are shares of each band
    assert begin - end < 3 * STRIP + 0.05


def test_ticks_are_those_of_the_bands() -> None:
    figure = make_bare_figure(6, 3)
    axes = add_axes(figure, 1.0, 0.5, 4.0, 2.0)
    use_band_axis(axes, [np.concatenate(BANDS)])
    ticks = axes.xaxis.get_majorticklocs()
    for band in BANDS:
        assert ((ticks >= band[0]) & (ticks <= band[-1])).sum() >= 2
    assert not ((ticks > 154) & (ticks < 705)).any()


def test_of_one_band_the_axis_stays_as_it_is() -> None:
    figure = make_bare_figure(6, 3)
    axes = add_axes(figure, 1.0, 0.5, 4.0, 2.0)
    use_band_axis(axes, BANDS[:1])
    assert axes.get_xscale() == "linear"


@pytest.mark.parametrize("jitter", [1e-3, 1e-2])
def test_levels_that_differ_a_little_in_frequency_share_their_bands(jitter: float) -> None:
    random = np.random.default_rng(0)
    curves = [np.concatenate(BANDS) + jitter * random.standard_normal(22) for _ in range(4)]
    assert [len(band) for band in join_bands(curves)] == [60, 28]
    assert [len(band) for band in join_bands([*curves, np.linspace(140.0, 720.0, 59)])] == [88 + 59]


def test_places_ascend_where_the_gap_is_narrow() -> None:
    bands = [np.arange(100.0, 401.0), np.arange(410.0, 501.0)]
    at = place(bands, np.arange(100.0, 501.0).tolist())
    assert (np.diff(at) > 0).all()
