"""The receptance inverts the dynamic stiffness."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.errors import ForceError, ModelError

# Damped a few per cent, so that the condition number at resonance stays below 1e5.
ROUND_OFF = 1e-10


def structure(seed: int, n: int = 7, *, rayleigh: bool = True, rank: int | None = None) -> DynamicStiffness:
    rng = np.random.default_rng(seed)
    a, b, c = rng.standard_normal((3, n, n))
    mass, stiffness = a @ a.T + np.eye(n), b @ b.T + np.eye(n)
    if rank is not None:
        stiffness = b[:, :rank] @ b[:, :rank].T
    damping = 0.05 * mass + 0.03 * stiffness if rayleigh else 0.05 * c @ c.T + 0.05 * np.eye(n)
    return DynamicStiffness(mass=mass, damping=damping, stiffness=stiffness)


def inverse(model: DynamicStiffness, omega: float) -> np.ndarray:
    return np.linalg.inv(model.stiffness - omega**2 * model.mass + 1j * omega * model.damping)


@given(seed=st.integers(0, 2**32 - 1), omega=st.floats(0, 20), rayleigh=st.booleans())
@settings(deadline=None)
def test_the_receptance_is_the_inverse(seed: int, omega: float, rayleigh: bool) -> None:
    model = structure(seed, rayleigh=rayleigh)
    assert model.damping_couples_modes is not rayleigh
    alpha = model.receptance(np.array([omega]))[0]
    expected = inverse(model, omega)
    np.testing.assert_allclose(alpha, expected, atol=ROUND_OFF * np.abs(expected).max())
    np.testing.assert_allclose(alpha, alpha.T, atol=ROUND_OFF * np.abs(expected).max())


@pytest.mark.parametrize("rayleigh", [True, False])
def test_rows_columns_and_response_are_parts_of_the_same(rayleigh: bool) -> None:
    model = structure(1, rayleigh=rayleigh)
    omega = np.array([0.0, 0.7, 3.0])
    alpha = model.receptance(omega)
    part = model.receptance(omega, np.array([4, 1]), np.array([0, 0, 6]))
    np.testing.assert_allclose(part, alpha[:, [4, 1]][:, :, [0, 0, 6]], rtol=ROUND_OFF)
    real, imaginary = np.random.default_rng(2).standard_normal((2, 3, 7))
    force = real + 1j * imaginary
    response = model.response(omega, force)
    np.testing.assert_allclose(response, np.einsum("prc,pc->pr", alpha, force), rtol=ROUND_OFF)
    np.testing.assert_allclose(model.force(omega, response), force, rtol=1e-9)
    several = np.stack([force, np.zeros_like(force), 2j * force])
    np.testing.assert_allclose(
        model.response(omega, several), np.stack([response, np.zeros_like(response), 2j * response]), rtol=ROUND_OFF
    )


def changed(what: str) -> DynamicStiffness:
    """A structure with Rayleigh damping, and one thing put on it that the damping does not know."""
    model = structure(4, n=12)
    matrices = {name: np.array(getattr(model, name)) for name in ("mass", "damping", "stiffness")}
    where = np.zeros(12)
    where[[3, 8]] = 1.0, -1.0
    match what:
        case "spring":
            matrices["stiffness"] += 5 * np.outer(where, where)
        case "mass":
            matrices["mass"][[1, 2, 3], [1, 2, 3]] += 2.0
        case "dashpot":
            matrices["damping"] += 0.4 * np.outer(where, where)
    return DynamicStiffness(**matrices)


def check_condensed(model: DynamicStiffness, omega: np.ndarray, B: np.ndarray, force: np.ndarray) -> None:
    """What directions see, and its derivatives, are those of the inverse."""
    alpha = np.array([inverse(model, float(item)) for item in omega])
    A, dA, x, dx = model.condense_with_slopes(omega, B, force)
    slope = -alpha @ (1j * model.damping - 2 * omega[:, None, None] * model.mass) @ alpha
    for result, expected in ((A, B @ alpha @ B.T), (dA, B @ slope @ B.T)):
        np.testing.assert_allclose(result, expected, atol=1e-9 * np.abs(expected).max())
    for result, expected in ((x, B @ alpha @ force[..., None]), (dx, B @ slope @ force[..., None])):
        np.testing.assert_allclose(result, expected[..., 0], atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("what", ["spring", "mass", "dashpot"])
def test_what_was_put_on_a_damped_structure_takes_no_dense_solves(what: str) -> None:
    model, omega = changed(what), np.array([0.0, 0.6, 1.7, 4.0])
    assert not model.damping_couples_modes
    # ... and it does couple the modes.
    V = model.modes.shapes
    modal = V.T @ model.damping @ V
    assert np.abs(modal - np.diag(np.diag(modal))).max() > 1e-3 * np.abs(modal).max()
    alpha = np.array([inverse(model, float(item)) for item in omega])
    size = np.abs(alpha).max()
    np.testing.assert_allclose(model.receptance(omega), alpha, atol=ROUND_OFF * size)
    real, imaginary = np.random.default_rng(2).standard_normal((2, 4, 12))
    force, B = real + 1j * imaginary, np.random.default_rng(3).standard_normal((5, 12))
    np.testing.assert_allclose(model.response(omega, force), np.einsum("prc,pc->pr", alpha, force), atol=1e-9 * size)
    check_condensed(model, omega, B, force)


def test_what_directions_see_is_that_of_the_inverse_whichever_were_asked_for_before() -> None:
    model, omega = structure(4, n=12), np.array([0.6, 1.7, 4.0])
    assert not model.damping_couples_modes
    real, imaginary = np.random.default_rng(2).standard_normal((2, 3, 12))
    force, (B, other) = real + 1j * imaginary, np.random.default_rng(3).standard_normal((2, 5, 12))
    for rows in (B, other, B):
        check_condensed(model, omega, rows, force)


@pytest.mark.parametrize("own", [0.0, 1.0])
def test_damping_that_is_not_symmetric_is_solved_as_it_is(own: float) -> None:
    model = structure(4, n=12)
    damping = np.array(model.damping)
    damping[2, 7] += 3.0
    damping[2, 2] += own
    gyro = DynamicStiffness(mass=model.mass, damping=damping, stiffness=model.stiffness)
    expected = inverse(gyro, 1.1)
    np.testing.assert_allclose(gyro.receptance(np.array([1.1]))[0], expected, atol=ROUND_OFF * np.abs(expected).max())


@pytest.mark.parametrize("stiff", [1e8, 1e10])
def test_a_dashpot_beside_stiff_springs_is_not_lost(stiff: float) -> None:
    n = 20
    chain = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    chain[[0, -1], [0, -1]] = 1.0
    stiffness = stiff * chain
    stiffness[0, 0] += 100.0
    omega = float(np.sqrt(100.0 / n))
    b = 2e-3 / omega
    damping = b * stiffness
    damping[10, 10] += 1.8e-9 * b * stiff
    model = DynamicStiffness(mass=np.eye(n), damping=damping, stiffness=stiffness)
    expected = inverse(model, omega)
    # Inverting the stiff chain itself costs 1e-16 times its stiffness over that of its support.
    np.testing.assert_allclose(
        model.receptance(np.array([omega]))[0], expected, atol=1e-15 * stiff / 100 * 1e3 * np.abs(expected).max()
    )


def test_no_frequencies_give_no_response() -> None:
    assert structure(1).response(np.zeros(0), np.zeros((0, 7), dtype=complex)).shape == (0, 7)


def test_one_mass_has_the_textbook_receptance() -> None:
    m, c, k = 2.0, 0.3, 50.0
    model = DynamicStiffness(mass=np.array([[m]]), damping=np.array([[c]]), stiffness=np.array([[k]]))
    omega = np.linspace(0, 12, 50)
    np.testing.assert_allclose(
        model.receptance(omega)[:, 0, 0], 1 / (k - m * omega**2 + 1j * c * omega), rtol=ROUND_OFF
    )


def test_two_masses_have_the_textbook_antiresonance() -> None:
    # A tuned absorber: the first mass stands still at sqrt(k2 / m2).
    model = DynamicStiffness(
        mass=np.diag([3.0, 0.5]),
        damping=np.zeros((2, 2)),
        stiffness=np.array([[30.0 + 8.0, -8.0], [-8.0, 8.0]]),
    )
    alpha = model.receptance(np.array([4.0]))[0]
    np.testing.assert_allclose(alpha[0], [0, -1 / 8], atol=1e-15)


def test_stiff_rows_do_not_spoil_soft_ones() -> None:
    scale = np.array([1.0, 1e3, 1e6])
    stiffness = (np.eye(3) + 0.3) * np.outer(scale, scale)
    model = DynamicStiffness(mass=np.eye(3), damping=1e-3 * np.eye(3), stiffness=stiffness)
    scaled = model.receptance(np.array([0.0]))[0].real * np.outer(scale, scale)
    # Error is round-off of the largest compliance, that of the first row; the last row is 1e12 times stiffer.
    np.testing.assert_allclose(scaled[0, :2], np.linalg.inv(np.eye(3) + 0.3)[0, :2], rtol=1e-10)


def test_a_free_body_answers_dynamic_forces_and_refuses_static_ones() -> None:
    model = structure(3, rank=5)
    assert model.n_rigid == 2
    expected = inverse(model, 0.4)
    np.testing.assert_allclose(model.receptance(np.array([0.4]))[0], expected, atol=ROUND_OFF * np.abs(expected).max())
    with pytest.raises(ForceError, match="2 rigid-body motions are free"):
        model.receptance(np.array([0.4, 0.0]))
    force = np.zeros((2, 7), dtype=complex)
    force[1, 0] = 1.0
    response = model.response(np.array([0.0, 0.4]), force)  # no static force: no static answer to refuse
    np.testing.assert_array_equal(response[0], 0)
    force[0, 0] = 1.0
    with pytest.raises(ForceError, match="remove the static force"):
        model.response(np.array([0.0, 0.4]), force)


def test_an_undamped_resonance_is_refused() -> None:
    model = DynamicStiffness(mass=np.eye(1), damping=np.zeros((1, 1)), stiffness=np.array([[9.0]]))
    with pytest.raises(ForceError, match="at 3 rad/s is exactly at the undamped mode 1"):
        model.receptance(np.array([2.0, 3.0]))


GOOD = np.diag([1.0, 2.0])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"mass": np.ones((2, 3))}, r"mass has shape \(2, 3\)"),
        ({"damping": np.eye(3)}, r"damping has shape \(3, 3\), the mass \(2, 2\)"),
        ({"stiffness": np.array([1.0, 2.0])}, r"stiffness has shape \(2,\)"),
        (
            {"stiffness": np.array([[1.0, 0.5], [0.4, 2.0]])},
            r"stiffness is not symmetric: entries \(0, 1\)",
        ),
        ({"damping": np.array([[1.0, np.nan], [0.0, 1.0]])}, r"damping holds nan at \(0, 1\)"),
        ({"mass": np.diag([1.0, -1.0])}, "^the mass has the eigenvalue -1 kg: the mass must be positive definite"),
        ({"mass": np.diag([1.0, 0.0])}, "^the mass has the eigenvalue 0 kg: the mass must be positive definite"),
        ({"stiffness": (1 + 0.1j) * GOOD}, r"stiffness holds 1\+0.1j at \(0, 0\): give real numbers"),
        ({"stiffness": np.diag([1.0, -1.0])}, "stiffness is indefinite: lowest eigenvalue -0.5"),
    ],
)
def test_matrices_of_no_structure_are_refused(wrong: dict, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        DynamicStiffness(**{"mass": GOOD, "damping": GOOD, "stiffness": GOOD, **wrong})


def test_a_row_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ModelError, match="row 7 does not exist: the model has rows 0 to 6"):
        structure(0).receptance(np.array([1.0]), rows=np.array([2, 7]))
