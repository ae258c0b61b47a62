"""Micro-slip and hysteresis against closed forms in a prescribed motion."""

from dataclasses import replace

import numpy as np
import pytest

from reduction.jointed_system import JenkinsChain, JenkinsElement, Joint
from tests.hbsolve.test_contact_laws import ONE, ROUND_OFF, Prescribed, cosine, random_motion

N_SAMPLE = 4096
#: Of a loop: its corners lie between instants, (2 pi / n)^2.
CORNERS = 3e-6


def loop_area(joint: Joint, amplitude: float, n_sample: int = N_SAMPLE) -> float:
    """Work of a cycle of u = A cos, in which only the sine of the force works."""
    first = Prescribed(joint, cosine(amplitude, 2), n_sample=n_sample).coefficients[1, 0]
    return float(np.pi * amplitude * first.imag)


# ---- chain of Jenkins elements

SPRINGS, LIMITS, BESIDE = np.array([3.0, 1.2, 0.7]), np.array([0.3, 0.5, 0.6]), 0.4
CHAIN = JenkinsChain(
    name="c", direction=ONE, tangential_stiffness=tuple(SPRINGS), limit_force=tuple(LIMITS), stiffness=BESIDE
)


@pytest.mark.parametrize("multiplier", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_a_chain_is_its_elements_and_its_spring(seed: int, multiplier: bool) -> None:
    motion, start = random_motion(1, seed), [0.1, -0.2, 0.05]
    chain = Prescribed(CHAIN, motion, start=start, multiplier=multiplier)
    force = BESIDE * chain.u
    for number, own in enumerate(start):
        element = JenkinsElement(
            name="j", direction=ONE, tangential_stiffness=SPRINGS[number], limit_force=LIMITS[number]
        )
        alone = Prescribed(element, motion, start=[own], multiplier=multiplier)
        force += alone.force
        np.testing.assert_allclose(chain.slider[number], alone.slider[0], atol=ROUND_OFF)
    np.testing.assert_allclose(chain.force, force, atol=ROUND_OFF)


@pytest.mark.parametrize("amplitude", [0.05, 0.3, 0.6, 2.0])
def test_the_loop_of_a_chain_is_the_sum_of_the_parallelograms(amplitude: float) -> None:
    area = 4 * np.sum(LIMITS * np.maximum(amplitude - LIMITS / SPRINGS, 0))
    assert loop_area(CHAIN, amplitude) == pytest.approx(area, rel=CORNERS, abs=ROUND_OFF)


def test_numbers_of_a_chain_have_names_of_their_own() -> None:
    assert CHAIN.parameter_names[1:4] == ("tangential_stiffness[1]", "tangential_stiffness[2]", "limit_force[0]")
    changed = CHAIN.with_values({"limit_force[1]": 0.9, "stiffness": 0.0})
    assert (changed.limit_force, changed.stiffness) == ((0.3, 0.9, 0.6), 0.0)
    assert replace(CHAIN, tangential_stiffness=2, limit_force=1).parameter_values == (2.0, 1.0, BESIDE)  # type: ignore[arg-type]
