"""Lines of measured and predicted curves: they end where a band does."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.prediction import Points
from figure.frf_overlay import FrfOverlay, OverlayCurve, OverlayPanel, draw_frf_overlay
from study.compare.curve import blank_gaps, compute_phase, refine_points

BANDS = np.concatenate([np.linspace(26.5, 32.5, 13), np.linspace(60.0, 76.0, 12)])
#: So many that a line has no points between them.
MANY = np.concatenate([np.linspace(26.5, 32.5, 60), np.linspace(60.0, 76.0, 60)])


def list_points(frequency: NDArray[np.float64]) -> Points:
    n = len(frequency)
    return Points(
        free=np.zeros(n, dtype=bool), level=np.ones(n), frequency=frequency, sensor=np.full(n, "tip"),
        harmonic=np.ones(n, dtype=int),
    )  # fmt: skip


@pytest.mark.parametrize("frequency", [BANDS, MANY])
def test_a_line_has_a_break_between_two_bands_and_nowhere_else(frequency: NDArray[np.float64]) -> None:
    fine = refine_points(list_points(frequency))
    assert set(frequency) <= set(fine.frequency)
    line = blank_gaps(fine, frequency, np.ones(len(fine), dtype=complex), np.arange(len(fine)))
    (broken,) = np.flatnonzero(np.isnan(line))
    assert 32.7 < fine.frequency[broken] < 60
    one_band = frequency[frequency < 40]
    fine = refine_points(list_points(one_band))
    line = blank_gaps(fine, one_band, np.ones(len(fine), dtype=complex), np.arange(len(fine)))
    assert np.isfinite(line).all()


def test_the_phase_goes_on_over_a_break_without_a_turn() -> None:
    angle = np.radians([-10.0, -80.0, -170.0, np.nan, -190.0, -260.0])
    np.testing.assert_allclose(
        compute_phase(np.exp(1j * angle), 0.0, 1), np.degrees(angle), atol=1e-9  # round-off
    )  # fmt: skip


def test_a_broken_line_is_drawn_on_both_sides() -> None:
    value = np.exp(-1j * np.radians(np.linspace(0, 300, len(BANDS))))
    fine = refine_points(list_points(BANDS)).frequency
    line = np.interp(fine, BANDS, value)
    line[(fine > 32.5) & (fine < 60)] = np.nan
    curve = OverlayCurve(
        level=0, frequency=BANDS, measured=value, deviation=np.full(len(BANDS), 0.01), predicted=value,
        line_frequency=fine, line=line,
    )  # fmt: skip
    panel = OverlayPanel(label="tip", unit="um/N", curves=[curve])
    figure = draw_frf_overlay(
        FrfOverlay(panels=[panel], levels=["1 N"], title="T", subtitle="S", columns=1, with_phase=True)
    )
    for axes in (figure.axes[0], figure.axes[2]):
        drawn = next(
            np.asarray(item.get_ydata(), dtype=float) for item in axes.lines if len(item.get_ydata()) == len(fine)
        )
        np.testing.assert_array_equal(np.isnan(drawn), np.isnan(line))
