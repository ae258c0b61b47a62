"""A structure on a shaken base: transmissibility, held amplitudes, contacts, and reduced meshes."""

import numpy as np
import pytest

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX8
from fe.material import STEEL
from fe.mesher.block import Block, mesh_blocks
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.continuation_parameter import FrequencyPath, equation
from hbsolve.continuation.response import frequency_response
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.solution import forces_at
from hbsolve.stability.branch_stability import branch_stability
from hbsolve.state import make_initial_sliders
from hbsolve.steady_state import steady_state
from reduction.base_excitation import BaseExcitation, BaseMotion
from reduction.craig_bampton import craig_bampton
from reduction.errors import JointError
from reduction.jointed_system import FrictionContact, JenkinsElement, JointedSystem
from transient.steady import steady_motion

#: A chain of two masses on the base: springs and dashpots from below [kg, N/m, N s/m].
MASS = np.diag([2.0, 1.0])
SPRING, DASHPOT = (4e4, 1e4), (30.0, 8.0)
STIFFNESS, DAMPING = (np.array([[a + b, -b], [-b, b]]) for a, b in (SPRING, DASHPOT))
BASE = BaseMotion.of(MASS, np.ones(2))


def relative(excitation: BaseExcitation, joints: tuple = ()) -> JointedSystem:
    return JointedSystem(
        mass=MASS, damping=DAMPING, stiffness=STIFFNESS, joints=joints, harmonic_force=excitation.force
    )


def transmissibility(omega: float) -> np.ndarray:
    """Absolute motion of both masses for a unit motion of the base."""
    push = np.array([SPRING[0] + 1j * omega * DASHPOT[0], 0.0])
    return np.linalg.solve(STIFFNESS - omega**2 * MASS + 1j * omega * DAMPING, push)


@pytest.mark.parametrize(("quantity", "power"), [("acceleration", 0), ("velocity", 1), ("displacement", 2)])
def test_a_held_amplitude_has_the_closed_form_of_two_masses(quantity: str, power: int) -> None:
    held, phase = 2e-3, np.exp(0.7j)
    excitation = BaseExcitation(base=BASE, amplitude=held * phase, quantity=quantity)
    balance = HarmonicBalance(system=relative(excitation), n_harmonic=2)
    curve = frequency_response(balance, 40.0, 220.0, level_power=excitation.level_power)
    absolute = excitation.absolute(curve.coefficients, curve.angular_frequency, curve.level)
    assert excitation.level_power == power
    for omega, result in zip(curve.angular_frequency, absolute[:, 1], strict=True):
        base = held * phase / (1j * omega) ** (2 - power)
        # Round-off of two small systems.
        np.testing.assert_allclose(result, transmissibility(omega) * base, rtol=1e-9)


def test_harmonics_with_phases_superpose() -> None:
    """Of a linear structure each harmonic is the closed form at its own frequency."""
    amplitudes, omega = np.array([0, 1e-3, 0, 4e-4 * np.exp(-1.1j)]), 30.0
    excitation = BaseExcitation(base=BASE, amplitude=amplitudes, quantity="displacement")
    balance = HarmonicBalance(system=relative(excitation), n_harmonic=5).at_level(omega**2)
    state = steady_state(balance, omega)
    absolute = excitation.absolute(state.coefficients, omega, state.level)
    for k in range(1, 4):
        np.testing.assert_allclose(absolute[k], transmissibility(k * omega) * amplitudes[k], rtol=1e-9, atol=1e-18)


def test_friction_on_a_base_is_that_of_time_integration_and_of_a_heavy_base() -> None:
    """Relative motion beside the integration in time; absolute motion beside a base of a large mass."""
    omega, held = 95.0, 3e-4
    excitation = BaseExcitation(base=BASE, amplitude=held, quantity="displacement")
    slip = JenkinsElement(name="slip", direction=[1, 0], tangential_stiffness=2e4, limit_force=3.0)
    system = relative(excitation, (slip,))
    balance = HarmonicBalance(system=system, n_harmonic=24).at_level(omega**2)
    state = steady_state(balance, omega)
    linear = steady_state(HarmonicBalance(system=relative(excitation), n_harmonic=24).at_level(omega**2), omega)
    assert abs(linear.coefficients[1, 1] / state.coefficients[1, 1] - 1) > 0.05
    loaded = JointedSystem(
        mass=MASS, damping=DAMPING, stiffness=STIFFNESS, joints=(slip,), harmonic_force=omega**2 * excitation.force
    )
    motion = steady_motion(loaded, omega, steps_per_period=4096).coefficients(4)
    # 24 harmonics leave 1e-5 of the motion, 4096 steps less.
    np.testing.assert_allclose(state.coefficients[:4], motion, rtol=0, atol=1e-4 * np.abs(motion[1]).max())
    heavy, weak, grown = 1e6, 1e6, np.zeros((3, 3))
    grown[1:, 1:] = STIFFNESS
    grown[0, :2] = grown[:2, 0] = -SPRING[0], -SPRING[0]
    grown[0, 0] = SPRING[0]
    damping = np.zeros((3, 3))
    damping[1:, 1:] = DAMPING
    damping[0, 1] = damping[1, 0] = -DASHPOT[0]
    damping[0, 0] = DASHPOT[0]
    # A weak spring holds the heavy base, which moves by held cos(omega t) whatever stands on it.
    grown[0, 0] += weak
    whole = JointedSystem(
        mass=np.diag([heavy, *np.diag(MASS)]), damping=damping, stiffness=grown,
        joints=[JenkinsElement(name="slip", direction=[-1, 1, 0], tangential_stiffness=2e4, limit_force=3.0)],
        harmonic_force=[[0, 0, 0], [(weak - heavy * omega**2) * held, 0, 0]],
    )  # fmt: skip
    told = steady_state(HarmonicBalance(system=whole, n_harmonic=24), omega)
    absolute = excitation.absolute(state.coefficients, omega, state.level)
    # The masses move the base by 4e4 / (1e6 omega^2) of its motion, 5e-6, and themselves by some times as much.
    np.testing.assert_allclose(absolute[1], told.coefficients[1, 1:], rtol=1e-4)


def test_a_curve_of_a_held_displacement_is_that_of_single_states_and_has_stability() -> None:
    excitation = BaseExcitation(base=BASE, amplitude=3e-4, quantity="displacement")
    rub = FrictionContact(
        name="rub", tangents=[0, 1], normal=[1, 0], tangential_stiffness=2e4, normal_stiffness=1e4,
        friction_coefficient=0.3, preload=6.0,
    )  # fmt: skip
    balance = HarmonicBalance(system=relative(excitation, (rub,)), n_harmonic=6, n_sample=256)
    curve = frequency_response(balance, 60.0, 130.0, step=5.0, level_power=2)
    np.testing.assert_allclose(curve.level, curve.angular_frequency**2, rtol=1e-12)
    for index in (3, 8):
        omega = float(curve.angular_frequency[index])
        state = steady_state(balance.at_level(omega**2), omega, start=curve.start(balance, index))
        # Two ends of Newton's method.
        np.testing.assert_allclose(state.coefficients, curve.coefficients[index], atol=1e-7 * 3e-4)
    assert branch_stability(balance, curve, n_sample=512).is_stable.all()
    path, x, still = (
        FrequencyPath(balance=balance, level_power=2),
        curve.start(balance, 5),
        make_initial_sliders(balance, None),
    )
    at, step = float(curve.angular_frequency[5]), 1e-3
    ends = [equation(path, at + way, x, still).residual for way in (step, -step)]
    difference = (ends[0] - ends[1]) / (2 * step)
    # Central differences: a third derivative times 1e-6, and round-off.
    np.testing.assert_allclose(
        equation(path, at, x, still).by_value, difference, rtol=0, atol=1e-6 * np.abs(difference).max()
    )


def test_a_reduced_mesh_moves_as_the_full_one_with_prescribed_supports() -> None:
    """The supports of the whole mesh are moved; with all modes the reduced model is the mesh in other coordinates."""
    mesh = mesh_blocks([Block.box(((0, 0.1), (0, 0.01), (0, 0.01)), (5, 1, 1), {"u0": "clamp", "u1": "end"})], HEX8)
    mass, stiffness = assemble(mesh, STEEL)
    system = supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes("clamp"))])
    rom = craig_bampton(system, {"end": system.rows(mesh.nodes("end"))}, n_mode=10_000)
    moved = np.zeros(3 * mesh.n_node)
    moved[2::3] = 1.0
    motion = BaseMotion.reduced(rom, moved[rom.free], (mass @ moved)[rom.free])
    np.testing.assert_allclose(motion.motion[: rom.n_boundary], rom.boundary_direction == 2)
    # Modal coordinates carry the inertia that the boundary does not.
    carried, b = rom.mass @ motion.motion, rom.n_boundary
    np.testing.assert_allclose(carried[b:], motion.inertia[b:], atol=1e-12 * np.abs(carried).max())
    omega = 2 * np.pi * 900.0
    held = np.setdiff1d(np.arange(3 * mesh.n_node), rom.free)
    full = (stiffness - omega**2 * mass).toarray()
    absolute = np.linalg.solve(full[np.ix_(rom.free, rom.free)], -full[np.ix_(rom.free, held)] @ moved[held])
    q = np.linalg.solve(rom.stiffness - omega**2 * rom.mass, omega**2 * motion.inertia)
    # Round-off of a stiffness with a condition of 1e5.
    np.testing.assert_allclose(rom.recovery @ q + moved[rom.free], absolute, atol=1e-8 * np.abs(absolute).max())


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"quantity": "jerk"}, 'quantity = "jerk": give acceleration, velocity, displacement'),
        ({"amplitude": np.nan}, "holds .nan"),
        ({"amplitude": [1.0, 2.0]}, "the first of them 0"),
        ({"amplitude": [[0, 1.0]]}, "give a number, or one for each harmonic"),
    ],
)
def test_what_is_no_motion_of_a_base_is_one_sentence(changes: dict, says: str) -> None:
    with pytest.raises(JointError, match=says):
        BaseExcitation(**{"base": BASE, "amplitude": 1.0, **changes})
    with pytest.raises(JointError, match=r"has shape \(3,\)"):
        BaseMotion.of(MASS, np.ones(3))


def test_limits_of_an_absolute_motion_bound_what_a_sensor_reads() -> None:
    """The measure of a motion with the base is the amplitude of its absolute displacement."""
    excitation, omega = BaseExcitation(base=BASE, amplitude=3.0), 90.0
    slip = JenkinsElement(name="slip", direction=[1, 0], tangential_stiffness=2e4, limit_force=3.0)
    balance = HarmonicBalance(system=relative(excitation, (slip,)), n_harmonic=5).at_level(2.0)
    state = steady_state(balance, omega)
    absolute = excitation.absolute(state.coefficients, omega, state.level)
    output = OutputHarmonic(row=1, base=complex(excitation.acceleration[1, 1]))
    g = forces_at(balance, omega, state.motion, state.sliders).coefficients
    result = output.measure(balance, balance.at(omega)).value(2.0, state.motion, g)
    # The motion solves its equations to 1e-9.
    assert result == pytest.approx(abs(absolute[1, 1]), rel=1e-7)
    assert result != pytest.approx(abs(state.coefficients[1, 1]), rel=0.01)
