"""Sensitivities of limits whose dependence on the parameters is known in closed form."""

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from study.paper import sensitivity
from study.paper.parameters import RigParameters
from study.paper.sensitivity import Sensitivity, compute_sensitivities

START = RigParameters(kt=4e6, kn=8e6, mu=0.5, damping=2e-3)
STEPS = {"kt": 8e4, "mu": 0.01, "gap_angle": 1e-4}
FREQUENCY = np.linspace(95.0, 105.0, 21)
LEVEL = 5.0


def make_bands(parameters: RigParameters, families: Any, frequency: np.ndarray) -> dict[tuple[str, int, float], Any]:
    """kt moves the peak, mu its upper limit, and a gap the static forces; a peak is a parabola."""
    del families
    peak = 100.0 * (parameters.kt / START.kt) ** 0.5
    curve = 1 - (frequency - peak) ** 2 / 400
    size = np.array([[1.0], [2.0 * parameters.mu / START.mu]])
    normal = 10.0 * (1 - 100 * parameters.gap_angle)
    force = np.array([normal - 1, normal + 1])[:, None] + 0 * frequency
    bands = {"tip": size * curve, "left_decoupler_N": force, "left_decoupler_T": 0.3 * force}
    return {
        (name, int(name == "tip"), LEVEL): SimpleNamespace(frequency=frequency, value=value)
        for name, value in bands.items()
    }


def compute(monkeypatch: pytest.MonkeyPatch, **options: Any) -> Sensitivity:
    monkeypatch.setattr(sensitivity, "sample_bands", make_bands)
    make: Any = lambda parameters: parameters  # noqa: E731 - stands for a model
    inputs: Any = None
    return compute_sensitivities(inputs, START, STEPS, [], FREQUENCY, LEVEL, make, **options)


def test_changes_by_a_step_down_and_up_are_those_of_the_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    result = compute(monkeypatch)
    assert result.names == tuple(STEPS)
    kt, mu, gap = range(3)
    # The vertex of a parabola through three points of a parabola is exact.
    np.testing.assert_allclose(result.frequency[kt], [0.98**0.5 - 1, 1.02**0.5 - 1], rtol=1e-9)
    np.testing.assert_allclose(result.upper[mu], [-0.02, 0.02], rtol=1e-9)
    np.testing.assert_allclose(result.lower[mu], 0.0, atol=1e-12)
    # A gap of zero has no step down.
    np.testing.assert_allclose(result.normal[gap], [0.0, -0.01], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(result.tangential[gap], [0.0, -0.003], rtol=1e-9, atol=1e-12)


def test_models_that_are_computed_side_by_side_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    reported: list[tuple[float, float]] = []
    with ThreadPoolExecutor(2) as executor:
        result = compute(monkeypatch, map_over=executor.map, report=lambda *numbers: reported.append(numbers))
    expected = compute(monkeypatch)
    for name in ("upper", "lower", "frequency", "normal", "tangential"):
        np.testing.assert_array_equal(getattr(result, name), getattr(expected, name))
    # The point itself, and both steps of each parameter.
    assert reported == [(number, 7) for number in range(1, 8)]
