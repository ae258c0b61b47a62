"""Jumps of curves whose steady states are known in closed form."""

import numpy as np
import pytest

from benchmarks.random_oscillators import Oscillator
from correlation.feature.jump import find_curve_jumps

DUFFING = Oscillator(kind="hardening", frequency=50.0, damping=0.005, strength=0.05)
FORCE = 0.01 * (2 * np.pi * 50.0) ** 2


def receptance(frequency: np.ndarray, modes: tuple[float, ...], damping: float = 0.005) -> np.ndarray:
    """Response of a linear structure with these natural frequencies and equal modal masses [m/N]."""
    omega, natural = 2 * np.pi * frequency[:, None], 2 * np.pi * np.array(modes)
    return (1 / (natural**2 - omega**2 + 2j * damping * natural * omega)).sum(axis=1)


@pytest.mark.parametrize(("bands", "modes"), [
    (((112, 154), (705, 735)), (131.0, 718.0)),
    (((45, 49), (103.5, 110.5)), (47.0, 107.0)),
])  # fmt: skip
def test_a_step_over_a_gap_between_two_bands_is_no_jump(
    bands: tuple[tuple[float, float], ...], modes: tuple[float, ...]
) -> None:
    frequency = np.concatenate([np.linspace(*band, 12) for band in bands])
    assert not len(find_curve_jumps(frequency, receptance(frequency, modes)))


@pytest.mark.parametrize("far", [30.0, 300.0])
def test_a_jump_in_one_of_two_bands_is_found(far: float) -> None:
    band, other = np.linspace(48, 54, 121), np.linspace(far, far + 3, 30)
    frequency, value = (
        np.concatenate([other, band]),
        np.concatenate([DUFFING.sweep(FORCE, item, 1) for item in (other, band)]),
    )
    order = np.argsort(frequency)
    (result,) = find_curve_jumps(frequency[order], value[order])
    (alone,) = find_curve_jumps(band, DUFFING.sweep(FORCE, band, 1))
    assert frequency[order][result] == band[alone]
