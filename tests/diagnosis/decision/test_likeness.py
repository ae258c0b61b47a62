"""Effects that the data cannot tell apart are equally probable."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.decision.evidence import DECISIVE, compute_probabilities
from diagnosis.decision.likeness import find_same


def refit(name: str, gain: float, cost: float = 0.0) -> Any:
    return SimpleNamespace(name=name, gain=gain, held_out_gain=10.0, cost=cost)


def along(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(("angle", "gains", "same"), [
    (0.99 * np.arcsin(np.sqrt(DECISIVE / 610)), (600.0, 600.0), True),
    (np.pi - 1e-3, (600.0, 600.0), True),
    (1.01 * np.arcsin(np.sqrt(DECISIVE / 610)), (600.0, 600.0), False),
    (0.0, (600.0, 530.0), True),
    (0.0, (600.0, 500.0), False),
])  # fmt: skip
def test_parallel_effects_that_gain_alike_are_the_same(angle: float, gains: tuple[float, float], same: bool) -> None:
    refits = [refit("a", gains[0]), refit("b", gains[1])]
    result = find_same(refits, {"a": along(0.0), "b": along(angle)})
    np.testing.assert_array_equal(result, [[True, same], [same, True]])


def test_an_effect_whose_direction_is_not_known_is_itself_alone() -> None:
    np.testing.assert_array_equal(find_same([refit("a", 9.0), refit("b", 9.0)], {"a": along(0.0)}), np.eye(2))


def test_effects_that_are_the_same_are_equally_probable_whatever_their_densities() -> None:
    refits = [refit("a", 600.0), refit("b", 600.0, cost=12.0), refit("c", 600.0, cost=4.0)]
    apart = compute_probabilities(refits)
    np.testing.assert_allclose(apart[1:] / apart[0], np.exp([-6.0, -2.0]), rtol=1e-12)
    result = compute_probabilities(refits, find_same(refits, {"a": along(0.0), "b": along(0.0), "c": along(1.0)}))
    np.testing.assert_allclose(result[1:] / result[0], [1.0, np.exp(-2.0)], rtol=1e-12)
