"""First guesses of section 4.1 from a loop whose stiffness and friction are known."""

import numpy as np
import pytest

from study.paper.campaign import Reference
from study.paper.first_guess import guess_first
from study.paper.virtual_tests import InstrumentLoop

STIFFNESS, FRICTION, NORMAL = 5e6, 12.0, 20.0


def loop(level: float, amplitude: float) -> InstrumentLoop:
    """A settled period of one Jenkins element under a constant normal force."""
    phase = 2 * np.pi * np.arange(256) / 256
    x, slider, force = amplitude * np.cos(np.tile(phase, 3)), 0.0, []
    for value in x:
        slider = float(np.clip(slider, value - FRICTION / STIFFNESS, value + FRICTION / STIFFNESS))
        force.append(STIFFNESS * (value - slider))
    last = slice(-256, None)
    return InstrumentLoop(
        level=level,
        frequency=250.0,
        displacement=x[last],
        tangential=np.array(force)[last],
        normal=np.full(256, NORMAL),
    )


def test_slopes_and_force_ratio_of_a_known_contact_come_back() -> None:
    low, high = loop(1.0, 0.5 * FRICTION / STIFFNESS), loop(10.0, 5 * FRICTION / STIFFNESS)
    guess = guess_first(Reference(campaign=None, loops=(low, high)))  # type: ignore[arg-type]  # loops alone are read
    # Stuck throughout: a straight line, to round-off.
    assert guess.peak_to_peak == pytest.approx(STIFFNESS, rel=1e-9)
    # 256 points of a period: the grid of elements and the corners between two points leave some 2 %.
    assert guess.kt == pytest.approx(STIFFNESS, rel=0.03)
    assert guess.mu == pytest.approx(FRICTION / NORMAL, rel=1e-9)


def test_without_gross_slip_the_force_ratio_is_a_lower_bound() -> None:
    low, high = loop(1.0, 0.5 * FRICTION / STIFFNESS), loop(10.0, 0.8 * FRICTION / STIFFNESS)
    guess = guess_first(Reference(campaign=None, loops=(low, high)))  # type: ignore[arg-type]  # loops alone are read
    assert guess.mu < FRICTION / NORMAL
