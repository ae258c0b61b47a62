"""Mistakes of a loop that one change of its signals explains are named; a model that is off is not."""

from dataclasses import replace

import numpy as np
import pytest

from correlation.data_quality.response import find_response_suspicions
from correlation.data_type.measured_loop import ForceLoop
from correlation.model import Model
from correlation.signal.loop import analyse_loop
from reduction.joint_law.jenkins import JenkinsElement
from reduction.jointed_system import JointedSystem

SPRING, LIMIT = 1e5, 2.0


def model(stiffer: float = 1.0, rougher: float = 1.0) -> Model:
    """A mass on a spring, held by a slider besides."""
    row = np.array([1.0])
    slider = JenkinsElement(
        name="slider", direction=row, tangential_stiffness=stiffer * SPRING, limit_force=rougher * LIMIT
    )
    force = np.array([[0.0], [1.0]], dtype=np.complex128)
    system = JointedSystem(
        mass=np.eye(1), damping=np.zeros((1, 1)), stiffness=np.array([[SPRING]]), joints=[slider], harmonic_force=force
    )
    return Model(system=system, sensors=(), places={"end": row})


def changed(x_factor: float = 1.0, f_factor: float = 1.0, x_offset: float = 0.0, f_offset: float = 0.0) -> ForceLoop:
    """The loop of that model at three times where it slips, from its closed form, with a mistake."""
    x = 3 * LIMIT / SPRING * np.cos(2 * np.pi * np.arange(5 * 200) / 200)
    slider, f = 0.0, np.zeros(len(x))
    for row, at in enumerate(x):
        rub = np.clip(SPRING * (at - slider), -LIMIT, LIMIT)
        slider, f[row] = at - rub / SPRING, SPRING * at + rub
    x, f = x_factor * (x + x_offset), f_factor * (f + f_offset)
    return ForceLoop(name="loop", displacement=x, force=f, loops=analyse_loop(x, f), frequency=1e-3, place="end")


@pytest.mark.parametrize(
    ("loop", "words"),
    [
        (changed(x_factor=1e-3), "with 1000 times its displacements"),
        (changed(x_factor=1e3), "with 0.001 times its displacements"),
        (changed(f_factor=1e3), "with 0.001 times its forces"),
        # The spring alone would give 3 N for this displacement.
        (changed(x_offset=3e-5, f_offset=25.0), "without its offset of 3e-05 m and 25 N"),
        (changed(f_offset=25.0), "without its offset of 25 N"),
    ],
)
def test_a_unit_and_an_offset_are_named(loop: ForceLoop, words: str) -> None:
    (result,) = find_response_suspicions(model(), [loop])
    assert words in result.sentence
    assert "; or by" not in result.sentence


def test_of_a_loop_that_sticks_force_and_displacement_are_both_named() -> None:
    x = 1e-8 * np.cos(2 * np.pi * np.arange(5 * 200) / 200)
    f = 2e3 * SPRING * x
    stuck = replace(changed(), displacement=x, force=f, loops=analyse_loop(x, f))
    (result,) = find_response_suspicions(model(), [stuck])
    assert "1000 times its displacements" in result.sentence
    assert "0.001 times its forces" in result.sentence


@pytest.mark.parametrize(("stiffer", "rougher"), [(1.0, 1.0), (1.3, 1.0), (1.0, 0.6), (3.0, 2.0)])
def test_a_model_that_is_right_or_merely_off_is_no_mistake_of_a_loop(stiffer: float, rougher: float) -> None:
    assert not find_response_suspicions(model(stiffer, rougher), [changed()])
