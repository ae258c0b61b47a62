"""What assurance criteria, pairing and linearity must satisfy, whatever their code."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.modal.assurance import (
    compute_coordinate_assurance,
    compute_domain_assurance,
    compute_modal_assurance,
    compute_response_assurance,
)
from correlation.modal.linearity import check_linearity
from correlation.modal.pairing import pair_modes

# A few dozen operations on numbers near one.
ROUND_OFF = 1e-13


def shapes(seed: int, n_sensor: int = 7, n_mode: int = 3) -> NDArray[np.complex128]:
    real, imaginary = np.random.default_rng(seed).standard_normal((2, n_sensor, n_mode))
    shape: NDArray[np.complex128] = real + 1j * imaginary
    return shape


@given(seed=st.integers(0, 2**32 - 1), magnitude=st.floats(1e-9, 1e9), phase=st.floats(0, 2 * np.pi))
def test_a_complex_factor_changes_nothing(seed: int, magnitude: float, phase: float) -> None:
    phi, factor = shapes(seed), magnitude * np.exp(1j * phase)
    np.testing.assert_allclose(np.diag(compute_modal_assurance(phi, factor * phi)), 1.0, atol=ROUND_OFF)
    np.testing.assert_allclose(compute_coordinate_assurance(phi, factor * phi), 1.0, atol=ROUND_OFF)
    np.testing.assert_allclose(compute_response_assurance(phi, factor * phi), 1.0, atol=ROUND_OFF)
    np.testing.assert_allclose(np.diag(compute_domain_assurance(phi, factor * phi)), 1.0, atol=ROUND_OFF)


def test_orthogonal_shapes_score_zero_and_sixty_degrees_a_quarter() -> None:
    np.testing.assert_allclose(compute_modal_assurance(np.eye(4), np.eye(4)), np.eye(4), atol=ROUND_OFF)
    turned = np.array([[np.cos(np.pi / 3)], [np.sin(np.pi / 3)]])
    np.testing.assert_allclose(compute_modal_assurance(np.array([[1.0], [0.0]]), turned), 0.25, atol=ROUND_OFF)


def test_a_swapped_sensor_is_the_lowest_comac() -> None:
    phi = shapes(0, 8, 4)
    wrong = phi.copy()
    wrong[[2, 5]] = phi[[5, 2]]
    comac = compute_coordinate_assurance(phi, wrong)
    assert set(np.argsort(comac)[:2]) == {2, 5}


@pytest.mark.parametrize(
    "criterion",
    [compute_modal_assurance, compute_coordinate_assurance, compute_response_assurance, compute_domain_assurance],
)
def test_other_numbers_of_sensors_are_refused(criterion: object) -> None:
    with pytest.raises(CampaignError, match=r"\(7, 3\)"):
        criterion(shapes(0), shapes(0, 5))  # type: ignore[operator]


def test_a_shape_of_zeros_is_refused() -> None:
    with pytest.raises(CampaignError, match="column 1"):
        compute_modal_assurance(np.array([[1.0, 0.0]]), np.array([[1.0]]))


def test_shuffled_modes_are_paired_and_missing_ones_listed() -> None:
    phi = np.linalg.qr(np.random.default_rng(1).standard_normal((12, 6)))[0]
    frequency = np.array([100.0, 102.0, 105.0, 150.0, 151.0, 200.0])
    order = [2, 0, 1, 4, 5]
    pairing = pair_modes(frequency[:5], phi[:, :5], 1.02 * frequency[order], -2 * phi[:, order])
    assert {(pair.measured, pair.model) for pair in pairing.pairs} == {(0, 1), (1, 2), (2, 0), (4, 3)}
    assert pairing.measured_only == (3,)
    assert pairing.model_only == ()
    assert all(pair.frequency_error == pytest.approx(0.02) for pair in pairing.pairs)


def test_equal_shapes_are_paired_by_frequency() -> None:
    one = np.ones((3, 2))
    pairing = pair_modes(np.array([100.0, 110.0]), one, np.array([111.0, 101.0]), one)
    assert {(pair.measured, pair.model) for pair in pairing.pairs} == {(0, 1), (1, 0)}


FREQUENCY = np.linspace(90, 110, 60)


def receptance(resonance: float) -> NDArray[np.complex128]:
    ratio = FREQUENCY / resonance
    value: NDArray[np.complex128] = 1 / (1 - ratio**2 + 0.02j * ratio)
    return value


def measured(
    resonances: list[float], seed: int, complex_values: bool = True
) -> tuple[NDArray[np.generic], NDArray[np.float64]]:
    random = np.random.default_rng(seed)
    values = np.array([receptance(resonance) for resonance in resonances])
    deviation = np.full(values.shape, 0.3)
    noise = random.standard_normal(values.shape) + 1j * random.standard_normal(values.shape)
    if complex_values:
        return values + 0.3 * noise, deviation
    return np.abs(values) + 0.3 * noise.real, deviation


@pytest.mark.parametrize("complex_values", [True, False])
def test_a_linear_structure_is_called_linear(complex_values: bool) -> None:
    wrong = 0
    for seed in range(50):
        values, deviation = measured([100.0] * 4, seed, complex_values)
        wrong += bool(check_linearity([1, 3, 5, 10], values, deviation).significant.any())
    assert wrong <= 2  # three tests per seed, each wrong in 1 of 1000: more than 2 has a probability of 6e-4


@pytest.mark.parametrize("complex_values", [True, False])
def test_the_levels_that_soften_are_named(complex_values: bool) -> None:
    values, deviation = measured([100.0, 100.0, 99.5, 98.0], 0, complex_values)
    result = check_linearity([1, 3, 5, 10], values, deviation)
    assert result.significant.tolist() == [False, False, True, True]
    truth = np.linalg.norm(receptance(98.0) - receptance(100.0)) / np.linalg.norm(receptance(100.0))
    if complex_values:
        # Noise of 0.3 beside responses of up to 50: a few parts in 100 of the index.
        assert result.index[3] == pytest.approx(truth, rel=0.05)
    assert "10 N" in result.sentence
    assert "not linear" in result.sentence


def test_one_level_says_nothing_about_linearity() -> None:
    with pytest.raises(CampaignError, match="two levels"):
        check_linearity([1.0], np.ones((1, 5)), np.ones((1, 5)))
