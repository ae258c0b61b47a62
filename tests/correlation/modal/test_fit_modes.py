"""Modes from frequency responses of systems whose modes are known, and of matrices that we did not fit."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import eigh

from correlation.errors import CampaignError
from correlation.modal.assurance import compute_modal_assurance
from correlation.modal.fit_modes import fit_modes
from tests.slow import slow

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def responses(frequency: Array, modes: Array, damping: Array, shapes: Array, power: int = 2, force: int = 0) -> Complex:
    """Responses to a force at one sensor, from the modal sum."""
    omega, own = 2 * np.pi * frequency[:, None], 2 * np.pi * modes
    receptance = 1 / (own**2 - omega**2 + 2j * damping * own * omega)
    values: Complex = (shapes * shapes[force]) @ receptance.T * (1j * omega[:, 0]) ** power
    return values


def noisy(values: Complex, random: np.random.Generator, share: float = 0.01) -> Complex:
    size = share * np.abs(values).max(axis=1, keepdims=True) / np.sqrt(2)
    return values + size * (random.standard_normal(values.shape) + 1j * random.standard_normal(values.shape))


def random_system(random: np.random.Generator, n_sensor: int = 6) -> tuple[Array, Array, Array]:
    modes = np.array([100.0, 102.0, 105.0]) * (1 + 1e-3 * random.standard_normal(3))
    shapes = random.standard_normal((n_sensor, 3))
    shapes[0] = random.choice([-1, 1], 3) * random.uniform(0.3, 1.0, 3)
    return modes, random.uniform(0.005, 0.01, 3), shapes


FREQUENCY = np.arange(90.0, 115.0, 0.05)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=slow) for seed in (1, 2, 3))])
def test_three_close_modes_in_noise(seed: int) -> None:
    random = np.random.default_rng(20_000 + seed)
    modes, damping, shapes = random_system(random)
    result = fit_modes(FREQUENCY, noisy(responses(FREQUENCY, modes, damping, shapes), random))
    assert len(result.frequency) == 3
    # The targets; benchmarks/signal_analysis.py scores 100 systems.
    np.testing.assert_allclose(result.frequency, modes, rtol=2e-4)
    np.testing.assert_allclose(result.damping_ratio, damping, rtol=0.05)
    assert (np.diag(compute_modal_assurance(shapes, result.shapes)) > 0.99).all()


@pytest.mark.parametrize("share", [0.005, *(pytest.param(share, marks=slow) for share in (0.001, 0.02))])
def test_noise_that_grows_with_the_response_has_no_modes_of_its_own(share: float) -> None:
    for seed in range(3):
        random = np.random.default_rng(21_000 + seed)
        modes, damping, shapes = random_system(random)
        clean = responses(FREQUENCY, modes, damping, shapes)
        error = random.standard_normal(clean.shape) + 1j * random.standard_normal(clean.shape)
        result = fit_modes(FREQUENCY, clean + share * np.abs(clean) * error / np.sqrt(2))
        assert len(result.frequency) == 3
        # Six numbers with their own deviations, of three seeds each: chance leaves four in 1 of 16000.
        assert (np.abs(result.frequency - modes) < 4 * result.frequency_deviation).all()
        assert (np.abs(result.damping_ratio - damping) < 4 * result.damping_deviation).all()


def test_a_single_line_is_no_mode() -> None:
    random = np.random.default_rng(22_000)
    modes, damping, shapes = random_system(random)
    values = noisy(responses(FREQUENCY, modes, damping, shapes), random)
    values[:, 400] += 0.2 * np.abs(values).max(axis=1)  # the hum of the mains, at 110 Hz
    result = fit_modes(FREQUENCY, values)
    # Without the hum the errors are 1e-4 and 1 %: one line of 500 adds little.
    np.testing.assert_allclose(result.frequency, modes, rtol=2e-4)
    np.testing.assert_allclose(result.damping_ratio, damping, rtol=0.05)


@pytest.mark.parametrize(
    ("quantity", "power"), [("displacement", 0), ("acceleration", 2), pytest.param("velocity", 1, marks=slow)]
)
def test_modes_without_noise_are_exact(quantity: str, power: int) -> None:
    modes, damping, shapes = random_system(np.random.default_rng(0))
    result = fit_modes(FREQUENCY, responses(FREQUENCY, modes, damping, shapes, power), quantity=quantity)
    # Gauss-Newton ends when a pole moves by 1e-7 of its decay.
    np.testing.assert_allclose(result.frequency, modes, rtol=1e-9)
    np.testing.assert_allclose(result.damping_ratio, damping, rtol=1e-6)
    assert (result.residual < 1e-6).all()


def test_sensors_of_different_quantities_are_fitted_as_they_were_measured() -> None:
    modes, damping, shapes = random_system(np.random.default_rng(0))
    quantities = ["displacement", "velocity", "acceleration"] * 2
    values = np.array(
        [responses(FREQUENCY, modes, damping, shapes, row % 3)[row] for row in range(len(quantities))]
    )  # fmt: skip
    result = fit_modes(FREQUENCY, values, quantity=quantities)
    np.testing.assert_allclose(result.frequency, modes, rtol=1e-9)
    assert (np.diag(compute_modal_assurance(shapes, result.shapes)) > 1 - 1e-9).all()
    np.testing.assert_allclose(result.fitted, values, rtol=1e-5)


def test_unit_modal_mass_comes_back_from_the_driving_point() -> None:
    modes, damping, shapes = random_system(np.random.default_rng(1))
    result = fit_modes(FREQUENCY, responses(FREQUENCY, modes, damping, shapes), driving_point=0)
    sign = np.sign((result.shapes.real * shapes).sum(axis=0))
    np.testing.assert_allclose(result.shapes * sign, shapes, atol=1e-5)
    assert not result.suspicions


def test_a_force_of_the_wrong_sign_is_suspected_at_the_driving_point() -> None:
    modes, damping, shapes = random_system(np.random.default_rng(1))
    result = fit_modes(FREQUENCY, -responses(FREQUENCY, modes, damping, shapes), driving_point=0)
    assert any("driving point" in sentence for sentence in result.suspicions)


def test_modes_outside_the_band_go_into_the_residual_terms() -> None:
    modes = np.array([20.0, 100.0, 102.0, 105.0, 300.0])
    random = np.random.default_rng(2)
    shapes = random.uniform(0.5, 1.0, (6, 5))
    damping = np.full(5, 0.007)
    result = fit_modes(FREQUENCY, responses(FREQUENCY, modes, damping, shapes))
    assert len(result.frequency) == 3
    # Two residual terms replace two modes: what they leave at a frequency ratio of 3 is a few parts in 1e4.
    np.testing.assert_allclose(result.frequency, modes[1:4], rtol=1e-5)
    np.testing.assert_allclose(result.damping_ratio, 0.007, rtol=5e-3)


def test_modes_of_matrices_with_damping_that_is_not_proportional() -> None:
    random = np.random.default_rng(3)
    n = 5
    mass = np.diag(random.uniform(1, 2, n))
    stiffness = 1e6 * (np.diag(np.full(n, 2.0)) - np.diag(np.ones(n - 1), 1) - np.diag(np.ones(n - 1), -1))
    damping = 2e-5 * stiffness
    damping[2, 2] += 30.0
    state = np.block(
        [[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]]
    )
    poles = np.linalg.eigvals(state)
    poles = poles[poles.imag > 0][np.argsort(poles[poles.imag > 0].imag)]
    frequency = np.arange(40.0, 350.0, 0.5)
    omega = 2 * np.pi * frequency
    values = np.array(
        [np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, np.eye(n)[0]) * -(w**2) for w in omega]
    ).T
    result = fit_modes(frequency, noisy(values, random, 1e-3))
    np.testing.assert_allclose(result.frequency, np.abs(poles) / (2 * np.pi), rtol=2e-4)
    np.testing.assert_allclose(result.damping_ratio, -poles.real / np.abs(poles), rtol=0.05)
    undamped = eigh(stiffness, mass)[1]
    assert (np.diag(compute_modal_assurance(undamped, result.shapes)) > 0.97).all()


def test_deviations_are_the_scatter_of_repeats() -> None:
    modes, damping, shapes = random_system(np.random.default_rng(4))
    clean = responses(FREQUENCY, modes, damping, shapes)
    scores = []
    for seed in range(20):
        result = fit_modes(FREQUENCY, noisy(clean, np.random.default_rng(30_000 + seed)), n_mode=3)
        scores.append(
            [
                *((result.frequency - modes) / result.frequency_deviation),
                *((result.damping_ratio - damping) / result.damping_deviation),
            ]
        )
    # Variance of 120 normal scores: 1 +- 0.13.
    assert np.mean(np.square(scores)) == pytest.approx(1, abs=0.35)


def test_an_exponential_window_is_taken_off() -> None:
    modes, damping, shapes = random_system(np.random.default_rng(5))
    decay = 2.0
    poles = 2 * np.pi * modes * (-damping + 1j * np.sqrt(1 - damping**2))
    s = 2j * np.pi * FREQUENCY[:, None] + decay
    residue = shapes * shapes[0] / (2j * poles.imag)
    values = residue @ (1 / (s - poles)).T + residue.conj() @ (1 / (s - poles.conj())).T
    result = fit_modes(FREQUENCY, values, quantity="displacement", decay=decay)
    np.testing.assert_allclose(result.damping_ratio, damping, rtol=1e-5)


def test_a_single_response_at_uneven_frequencies() -> None:
    random = np.random.default_rng(6)
    frequency = np.sort(np.concatenate([random.uniform(95, 105, 40), random.uniform(99, 101, 40)]))
    values = responses(frequency, np.array([100.0]), np.array([0.004]), np.array([[1.0]]))
    result = fit_modes(frequency, noisy(values, random))
    assert len(result.frequency) == 1
    assert abs(result.frequency[0] - 100) < 4 * result.frequency_deviation[0]
    assert result.damping_ratio[0] == pytest.approx(0.004, rel=0.05)


def test_noise_has_no_modes() -> None:
    random = np.random.default_rng(7)
    empty = random.standard_normal((4, len(FREQUENCY))) + 1j * random.standard_normal((4, len(FREQUENCY)))
    with pytest.raises(CampaignError, match="no mode"):
        fit_modes(FREQUENCY, empty)


@pytest.mark.parametrize(
    ("frequency", "values", "changes", "word"),
    [
        (FREQUENCY, np.ones((2, 7)), {}, "shape"),
        (FREQUENCY[::-1], np.ones((1, len(FREQUENCY))), {}, "rise"),
        (FREQUENCY, np.zeros((1, len(FREQUENCY))), {}, "zero"),
        (FREQUENCY, np.ones((1, len(FREQUENCY))), {"band": (1.0, 2.0)}, "0 lines"),
        (FREQUENCY, np.ones((1, len(FREQUENCY))), {"quantity": "force"}, "force"),
        (FREQUENCY, np.ones((2, len(FREQUENCY))), {"quantity": ["velocity"]}, "1 quantities for 2"),
    ],
)
def test_unusable_responses_are_refused(frequency: Array, values: Array, changes: dict[str, object], word: str) -> None:
    with pytest.raises(CampaignError, match=word):
        fit_modes(frequency, values, **changes)  # type: ignore[arg-type]
