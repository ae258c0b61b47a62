"""Without joints every step is exact, whatever its length."""

import numpy as np
import pytest
from numpy.typing import NDArray

from reduction.jointed_system import JointedSystem
from transient.integrate import integrate
from transient.state import TransientState, start_from

# A few thousand steps, each exact to a few units in the last place.
ROUND_OFF = 1e-11

DISPLACEMENT = {"x": np.array([1.0])}


def oscillator(damping: float, force: complex = 0.0, static: float = 0.0, stiffness: float = 4.0) -> JointedSystem:
    return JointedSystem(
        mass=np.eye(1),
        damping=np.array([[damping]]),
        stiffness=np.array([[stiffness]]),
        harmonic_force=np.array([[0.0], [force]]),
        static_load=np.array([static]),
    )


def state(displacement: float, velocity: float) -> TransientState:
    return TransientState(displacement=np.array([displacement]), velocity=np.array([velocity]), slider=np.zeros(0))


def test_free_decay_equals_the_closed_form() -> None:
    motion = integrate(oscillator(0.2), 1.0, 10, 9, state(1.0, 0.5), outputs=DISPLACEMENT)
    t, decay, omega = motion.time, 0.1, np.sqrt(4 - 0.01)
    x = np.exp(-decay * t) * (np.cos(omega * t) + (0.5 + decay) / omega * np.sin(omega * t))
    np.testing.assert_allclose(motion.output_displacement["x"], x, atol=ROUND_OFF)


@pytest.mark.parametrize("damping", [0.0, 4.0, 50.0], ids=["undamped", "critical", "overdamped"])
def test_the_answer_to_a_step_of_load_equals_the_closed_form(damping: float) -> None:
    motion = integrate(oscillator(damping, static=2.0), 1.0, 3, 64, state(0.0, 0.0), outputs=DISPLACEMENT)
    t = motion.time
    root = np.sqrt(complex(damping**2 / 4 - 4))
    if damping == 4.0:
        x, v = 0.5 - np.exp(-2 * t) * (0.5 + t), 2 * t * np.exp(-2 * t)
    else:
        x = 0.5 - 0.5 * np.exp(-damping / 2 * t) * (np.cosh(root * t) + damping / 2 / root * np.sinh(root * t)).real
        v = 2.0 * np.exp(-damping / 2 * t) * (np.sinh(root * t) / root).real
    np.testing.assert_allclose(motion.output_displacement["x"], x, atol=ROUND_OFF)
    np.testing.assert_allclose(motion.output_velocity["x"], v, atol=ROUND_OFF)


def test_a_free_body_falls_as_half_t_squared() -> None:
    motion = integrate(oscillator(0.0, static=3.0, stiffness=0.0), 1.0, 2, 16, state(0.0, 0.0), outputs=DISPLACEMENT)
    np.testing.assert_allclose(motion.output_displacement["x"], 1.5 * motion.time**2, rtol=ROUND_OFF, atol=ROUND_OFF)


def test_undamped_resonance_grows_linearly() -> None:
    motion = integrate(oscillator(0.0, force=1.0), 2.0, 20, 8, state(0.0, 0.0), outputs=DISPLACEMENT)
    t = motion.time
    np.testing.assert_allclose(motion.output_displacement["x"], t * np.sin(2 * t) / 4, atol=1e-10)


@pytest.mark.parametrize("diagonal", [True, False], ids=["diagonal damping", "full damping"])
def test_a_start_on_the_steady_state_stays_there(diagonal: bool) -> None:
    random = np.random.default_rng(3)
    n = 5
    shape = random.standard_normal((n, n))
    mass, stiffness = np.eye(n) + 0.1 * shape @ shape.T, 3 * np.eye(n) + shape.T @ shape
    damping = 0.01 * stiffness if diagonal else np.diag(random.uniform(0.0, 0.2, n))
    force = np.zeros((4, n), dtype=complex)
    force[1], force[3] = random.standard_normal(n), 1j * random.standard_normal(n)
    static = random.standard_normal(n)
    system = JointedSystem(mass=mass, damping=damping, stiffness=stiffness, harmonic_force=force, static_load=static)
    omega, level = 1.3, 0.7
    response = np.array(
        [
            np.linalg.solve(stiffness - (k * omega) ** 2 * mass + 1j * k * omega * damping, f)
            for k, f in enumerate(level * force + (np.arange(4) == 0)[:, None] * static)
        ]
    )
    rows = {str(i): row for i, row in enumerate(np.eye(n))}
    motion = integrate(system, omega, 3, 10, start_from(system, omega, response), level, outputs=rows)
    phase = np.exp(1j * omega * np.outer(np.arange(4), motion.time))
    expected = (response.T @ phase).real
    rate = (response.T @ (1j * omega * np.arange(4)[:, None] * phase)).real
    np.testing.assert_allclose(list(motion.output_displacement.values()), expected, atol=ROUND_OFF)
    np.testing.assert_allclose(list(motion.output_velocity.values()), rate, atol=ROUND_OFF)


def test_the_units_of_the_coordinates_do_not_change_the_motion() -> None:
    """Eigenvalues of this mass come out negative by round-off, although it is definite in any units."""
    scale = np.where(np.arange(12) % 2, 1.0, 2.0**-38)
    mass = np.eye(12) + 0.5
    stiffness = np.diag(np.arange(1.0, 13.0))
    force = np.outer([0, 1], np.ones(12))

    def motion(scale: NDArray[np.float64]) -> NDArray[np.float64]:
        both = np.outer(scale, scale)
        system = JointedSystem(
            mass=both * mass,
            damping=0.1 * both * stiffness,
            stiffness=both * stiffness,
            harmonic_force=(force * scale).astype(complex),
        )
        rest = TransientState(displacement=np.zeros(12), velocity=np.zeros(12), slider=np.zeros(0))
        outputs = {"sum": scale}
        return integrate(system, 1.0, 2, 16, rest, outputs=outputs).output_displacement["sum"]

    np.testing.assert_allclose(motion(scale), motion(np.ones(12)), rtol=1e-9, atol=ROUND_OFF)  # round-off of the modes
