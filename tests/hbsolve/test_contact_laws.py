"""Every joint law against its closed form in a prescribed motion."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import gamma

from hbsolve.aft import InitialSliders, joint_forces
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion, contact_share
from hbsolve.joint_arrays import make_joint_table
from hbsolve.joint_law.registry import SEPARATED, SLIP, STICK
from hbsolve.sampling import complex_from_real, sampling
from hbsolve.steady_state import steady_state
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    HertzContact,
    IwanJoint,
    JenkinsChain,
    JenkinsElement,
    Joint,
    JointedSystem,
    PiecewiseDamper,
    PiecewiseSpring,
    Play,
    PolynomialSpring,
    PowerSpring,
    QuadraticDamper,
    SmoothFriction,
    StructuralDamper,
    ViscousDamper,
)

Array = NDArray[np.float64]
ONE = np.ones(1)
ROUND_OFF = 1e-12
OMEGA = 2.3


class Prescribed:
    """A joint in a prescribed motion of its directions, rows [mean, cos, sin, cos 2, sin 2, ...]."""

    def __init__(
        self, joint: Joint, motion: object, *, n_sample: int = 256, start: object = None, multiplier: bool = False
    ) -> None:
        x = np.atleast_2d(np.asarray(motion, dtype=float))
        table, samples = make_joint_table([joint]), sampling((x.shape[1] + 1) // 2, n_sample)
        count = int(table.slider[-1])
        value = np.zeros(count) if start is None else np.asarray(start, dtype=float)
        out = joint_forces(x, OMEGA, table, InitialSliders(value, np.full(count, int(multiplier))), samples, 0)
        self.u = x @ samples.evaluate
        self.force = out.force + table.reference[:, None] * self.u
        #: f_k of each direction, shape (H + 1, d).
        self.coefficients = complex_from_real(out.coefficients + table.reference[:, None] * x)
        self.slider, self.status = out.slider, out.status


def contact(n_tangent: int = 1, **changes: object) -> FrictionContact:
    rows = np.eye(n_tangent + 1)
    made = FrictionContact(
        name="contact",
        normal=rows[-1],
        tangents=rows[:-1],
        normal_stiffness=2.0,
        tangential_stiffness=1.1,
        friction_coefficient=0.4,
        preload=0.3,
        gap=0.1,
    )
    return replace(made, **changes)  # type: ignore[arg-type]


def random_motion(d: int, seed: int, mean: float = 0.0, n_harmonic: int = 4) -> Array:
    x = np.random.default_rng(seed).normal(size=(d, 2 * n_harmonic - 1)) / 3
    x[-1, 0] = mean
    return x


def cosine(amplitude: float, n_harmonic: int) -> Array:
    x = np.zeros(2 * n_harmonic - 1)
    x[1] = amplitude
    return x


# ---- Jenkins


def loop_area_error(n_sample: int) -> float:
    kt, limit, A = 3.0, 0.7, 1.9
    jenkins = JenkinsElement(name="j", direction=ONE, tangential_stiffness=kt, limit_force=limit)
    # In u = A cos, only the sine of the force works: the area of the loop is pi A Im f_1.
    area = np.pi * A * Prescribed(jenkins, cosine(A, 2), n_sample=n_sample).coefficients[1, 0].imag
    return float(abs(area / (4 * limit * (A - limit / kt)) - 1))


def test_the_jenkins_loop_has_its_closed_area_with_order_two_in_the_samples() -> None:
    assert loop_area_error(4096) < 2e-6  # kinks between instants: (2 pi / n)^2
    order = np.log2(loop_area_error(128) / loop_area_error(2048)) / 4
    assert order > 1.7  # 2, with the wobble of where a kink falls between two instants


def test_dissipated_work_of_a_steady_state_is_the_jenkins_loop_area() -> None:
    kt, limit = 3.0, 0.7
    system = JointedSystem(
        mass=[[1.0]],
        damping=[[0.02]],
        stiffness=[[1.0]],
        joints=[JenkinsElement(name="j", direction=ONE, tangential_stiffness=kt, limit_force=limit)],
        harmonic_force=[[0.0], [1.3]],
    )
    # With one harmonic the motion has one amplitude, and the loop is the closed one.
    balance = HarmonicBalance(system=system, n_harmonic=2, n_sample=2048)
    state = steady_state(balance, 1.6)
    (motion,) = contact_motion(balance, state)
    A = state.amplitude(0)
    assert 1.2 * limit / kt < A  # it slips
    np.testing.assert_allclose(motion.dissipated, [4 * limit * (A - limit / kt)], rtol=1e-5)  # (2 pi / n)^2
    assert motion.share[SEPARATED] == 0
    assert np.abs(motion.force).max() <= limit * (1 + ROUND_OFF)


def test_a_stuck_jenkins_element_is_its_spring() -> None:
    jenkins = JenkinsElement(name="j", direction=ONE, tangential_stiffness=3.0, limit_force=1e3)
    motion = random_motion(1, 0)
    stuck = Prescribed(jenkins, motion)
    np.testing.assert_allclose(stuck.force, 3.0 * stuck.u, atol=ROUND_OFF)
    held = Prescribed(jenkins, motion, start=[0.2])
    np.testing.assert_allclose(held.force, 3.0 * (held.u - 0.2), atol=ROUND_OFF)
    assert (stuck.status[0] == STICK).all()


# ---- micro-slip

IWAN = IwanJoint(
    name="i", direction=ONE, tangential_stiffness=3.0, limit_force=0.6, exponent=-0.4, ratio=0.5,
)  # fmt: skip
#: Segalman's eqs for the displacement of macro-slip and R.
INNER = 0.6 / 1.6
MACRO = 0.6 * 1.5 / (3.0 * (0.5 + INNER))
R = 0.6 * 0.6 / (MACRO**1.6 * (0.5 + INNER))


@pytest.mark.parametrize("share", [0.02, 0.1, 0.5, 1.0])
def test_the_work_of_an_iwan_joint_is_a_power_of_the_amplitude(share: float) -> None:
    A = share * MACRO
    first = Prescribed(IWAN, cosine(A, 2), n_sample=1024).coefficients[1, 0]
    # Each slider that slips loses 4 phi (A - phi) a cycle.
    work = 4 * R * A**2.6 / (1.6 * 2.6)
    assert np.pi * A * first.imag == pytest.approx(work, rel=0.02)  # cells of 25 %


def test_an_iwan_joint_is_a_spring_at_first_and_slides_at_its_limit_at_last() -> None:
    small = Prescribed(IWAN, cosine(1e-4 * MACRO, 2))
    np.testing.assert_allclose(small.force, 3.0 * small.u, rtol=1e-9)
    large = Prescribed(IWAN, cosine(9 * MACRO, 2))
    assert np.abs(large.force).max() == pytest.approx(0.6, rel=1e-12)
    assert (large.status[0] == SLIP).any()
    assert (large.status[0] == STICK).any()


@pytest.mark.parametrize("multiplier", [False, True])
def test_an_iwan_joint_without_a_last_spring_slides_at_its_limit_as_well(multiplier: bool) -> None:
    bare = replace(IWAN, ratio=0.0)
    large = Prescribed(bare, cosine(9 * MACRO, 2), multiplier=multiplier)
    assert np.abs(large.force).max() == pytest.approx(0.6, rel=1e-12)
    assert (large.status[0] == SLIP).any()


CHAINS = [
    JenkinsChain(
        name="c",
        direction=ONE,
        tangential_stiffness=tuple(np.array([1.0, 2.0, 1.5])[order].tolist()),
        limit_force=tuple(np.array([0.1, 0.6, 0.2])[order].tolist()),
    )
    for order in ([0, 1, 2], [2, 1, 0], [1, 2, 0])
]


@pytest.mark.parametrize(("joint", "reach"), [*((chain, 0.3) for chain in CHAINS), (IWAN, MACRO)])
def test_sliders_in_parallel_slip_where_the_last_one_does_whatever_their_order(joint: Joint, reach: float) -> None:
    system = JointedSystem(
        mass=[[1.0]], damping=[[0.5]], stiffness=[[1.0]], joints=[joint], harmonic_force=[[0.0], [3.0]]
    )
    balance = HarmonicBalance(system=system, n_harmonic=2, n_sample=2048)
    state = steady_state(balance, 1.6)
    (motion,) = contact_motion(balance, state)
    # With one harmonic: after a turn the last slider sticks until A (1 - cos) is twice its reach.
    stuck = np.arccos(1 - 2 * reach / state.amplitude(0)) / np.pi
    assert 0.2 < stuck < 0.8
    np.testing.assert_allclose(motion.share, [stuck, 1 - stuck, 0], atol=2e-3)  # one instant at each end
    np.testing.assert_array_equal(contact_share(balance, state), [motion.share])


# ---- springs, stop and drag


def test_the_cubic_spring_has_three_quarters_and_one_quarter() -> None:
    k, A = 0.7, 1.4
    f = Prescribed(CubicSpring(name="c", direction=ONE, stiffness=k), cosine(A, 6)).coefficients[:, 0]
    np.testing.assert_allclose(f, [0, 3 / 4 * k * A**3, 0, 1 / 4 * k * A**3, 0, 0], atol=ROUND_OFF)


def test_the_polynomial_spring_has_the_powers_of_a_cosine() -> None:
    k2, k3, k4, k5, A = 0.7, -0.4, 0.3, 0.2, 1.4
    spring = PolynomialSpring(name="p", direction=ONE, quadratic=k2, cubic=k3, quartic=k4, quintic=k5)
    f = Prescribed(spring, cosine(A, 6)).coefficients[:, 0]
    even, odd = np.array([k2 * A**2 / 2, k4 * A**4 / 8]), np.array([k3 * A**3 / 4, k5 * A**5 / 16])
    expected = [
        even @ [1, 3], odd @ [3, 10], even @ [1, 4], odd @ [1, 5], even @ [0, 1], odd @ [0, 1],
    ]  # fmt: skip
    np.testing.assert_allclose(f, expected, atol=ROUND_OFF)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 3.0, 5.0])
def test_the_power_spring_has_the_fundamental_of_a_power_of_the_cosine(exponent: float) -> None:
    k, r, A = 0.7, 0.9, 1.4
    spring = PowerSpring(name="p", direction=ONE, stiffness=k, reference=r, exponent=exponent)
    f = Prescribed(spring, cosine(A, 2), n_sample=4096).coefficients[:, 0]
    # Wallis' integral of |cos|^(p + 1).
    share = 2 / np.sqrt(np.pi) * gamma(exponent / 2 + 1) / gamma((exponent + 3) / 2)
    # A kink of the second derivative at p = 2, of a fraction of it at 1.5, between instants: order 2.5.
    np.testing.assert_allclose(f, [0, share * k * A * (A / r) ** (exponent - 1)], atol=1e-7)


@pytest.mark.parametrize("gap", [0.0, 0.4, 1.2])
def test_the_play_has_the_fundamental_of_a_wave_without_its_middle(gap: float) -> None:
    k, A = 3.0, 1.1
    f = Prescribed(Play(name="p", direction=ONE, stiffness=k, gap=gap), cosine(A, 2), n_sample=4096).coefficients[:, 0]
    share = min(gap / A, 1.0)
    first = k * A * (1 - 2 / np.pi * (np.arcsin(share) + share * np.sqrt(1 - share**2)))
    np.testing.assert_allclose(f, [0, first], atol=2e-5)  # kinks between instants


def test_two_piecewise_springs_with_a_kink_are_a_play() -> None:
    k, gap, A = 3.0, 0.4, 1.1
    pieces = [PiecewiseSpring(name="p", direction=side * ONE, width=gap, stiffness=(0.0, k)) for side in (1.0, -1.0)]
    both = sum(Prescribed(item, side * cosine(A, 4)).coefficients[:, 0] * side
               for item, side in zip(pieces, (1.0, -1.0), strict=True))  # fmt: skip
    play = Prescribed(Play(name="p", direction=ONE, stiffness=k, gap=gap), cosine(A, 4)).coefficients[:, 0]
    np.testing.assert_allclose(both, play, atol=ROUND_OFF)


def test_a_piecewise_damper_of_one_piece_is_a_dashpot() -> None:
    c, A = 0.7, 1.1
    piece = PiecewiseDamper(name="p", direction=ONE, width=0.3, damping=(c, 0.0))
    dashpot = ViscousDamper(name="d", direction=ONE, damping=c)
    result, expected = (Prescribed(item, cosine(A, 3)).coefficients for item in (piece, dashpot))
    np.testing.assert_allclose(result, expected, atol=ROUND_OFF)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_the_curved_contact_has_the_coefficients_of_a_power_of_half_a_wave(exponent: float) -> None:
    k, r, A = 0.7, 0.9, 1.4
    contact = HertzContact(name="h", direction=ONE, stiffness=k, reference=r, exponent=exponent)
    f = Prescribed(contact, cosine(A, 2), n_sample=4096).coefficients[:, 0]
    # Wallis' integrals of cos^p and cos^(p + 1) over the half in which it is positive.
    mean, first = (gamma((power + 1) / 2) / gamma(power / 2 + 1) / np.sqrt(np.pi) for power in (exponent, exponent + 1))
    np.testing.assert_allclose(f, k * r * (A / r) ** exponent * np.array([mean / 2, first]), atol=2e-7)


def test_the_dashpot_is_a_quarter_of_a_period_ahead() -> None:
    c, A = 0.7, 1.4
    f = Prescribed(ViscousDamper(name="v", direction=ONE, damping=c), cosine(A, 3)).coefficients[:, 0]
    np.testing.assert_allclose(f, [0, 1j * c * OMEGA * A, 0], atol=ROUND_OFF)


@pytest.mark.parametrize(("velocity", "limit"), [(1e-3, 4 / np.pi), (1e3, 0.0)])
def test_smooth_friction_is_coulombs_where_it_is_steep_and_a_dashpot_where_it_is_not(
    velocity: float, limit: float
) -> None:
    F, A = 0.7, 1.4
    friction = SmoothFriction(name="s", direction=ONE, limit_force=F, velocity=velocity * OMEGA * A)
    (first,) = Prescribed(friction, cosine(A, 2), n_sample=8192).coefficients[1]
    expected = F * limit if limit else F / velocity
    # Within 1e-3 of a radian it is below the limit, of which the square counts; tanh x is x - x^3 / 3.
    assert first == pytest.approx(1j * expected, rel=1e-5)


@pytest.mark.parametrize("gap", [0.0, 0.4, -0.3])
def test_the_stop_has_the_coefficients_of_a_clipped_wave(gap: float) -> None:
    k, A, n = 3.0, 1.1, 4096
    f = Prescribed(ElasticStop(name="s", direction=ONE, stiffness=k, gap=gap), cosine(A, 5), n_sample=n).coefficients
    a = np.arccos(gap / A)  # half of the contact angle
    mean, first = k / np.pi * (A * np.sin(a) - gap * a), k * A / np.pi * (a - np.sin(a) * np.cos(a))
    h = np.arange(2, 5)
    higher = 2 * k / np.pi * (A / 2 * (np.sin((h + 1) * a) / (h + 1) + np.sin((h - 1) * a) / (h - 1)))
    higher -= 2 * k / np.pi * gap * np.sin(h * a) / h
    np.testing.assert_allclose(f[:, 0], [mean, first, *higher], atol=2e-5)  # two kinks between instants
    if gap == 0:
        np.testing.assert_allclose(f[:3, 0], k * A * np.array([1 / np.pi, 1 / 2, 2 / (3 * np.pi)]), atol=2e-5)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 1.7])
def test_the_structural_damper_takes_the_work_of_a_complex_stiffness(exponent: float) -> None:
    k, eta, r, A = 3.0, 0.2, 0.7, 1.4
    slow = 1e-3 * OMEGA * A  # the step of the velocity is over in a thousandth of a period: 1e-6 of the work
    damper = StructuralDamper(
        name="d", direction=ONE, stiffness=k, loss_factor=eta, reference=r, exponent=exponent, velocity=slow
    )
    f = Prescribed(damper, cosine(A, 4), n_sample=4096).coefficients[:, 0]
    np.testing.assert_allclose(f[1].imag, k * eta * (A / r) ** exponent * A, rtol=1e-5)
    assert abs(f[1].real) < 1e-9


def test_the_quadratic_damper_has_eight_thirds_over_pi() -> None:
    c, A = 0.3, 1.4
    f = Prescribed(QuadraticDamper(name="d", direction=ONE, damping=c), cosine(A, 4), n_sample=4096).coefficients[:, 0]
    drag = c * OMEGA**2 * A**2
    # |sin| sin has the sines 8 / (3 pi), 0, -8 / (15 pi); u = A cos moves backwards first. One jump of f'': order 3.
    np.testing.assert_allclose(f, [0, 8j / (3 * np.pi) * drag, 0, -8j / (15 * np.pi) * drag], atol=1e-7)


# ---- friction under a varying normal load


@pytest.mark.parametrize("friction", Friction)
@pytest.mark.parametrize("n_tangent", [1, 2])
def test_the_normal_force_and_coulombs_limit_hold_at_every_instant(n_tangent: int, friction: Friction) -> None:
    joint = contact(n_tangent, friction=friction)
    for seed in range(4):
        p = Prescribed(joint, random_motion(n_tangent + 1, seed))
        T, N = p.force[:-1], p.force[-1]
        np.testing.assert_allclose(N, np.maximum(0.3 + 2.0 * (p.u[-1] - 0.1), 0), atol=ROUND_OFF)
        apart = N < ROUND_OFF
        assert apart.any()
        assert not apart.all()
        coupled = friction is Friction.COULOMB and n_tangent == 2
        resultant = np.hypot(*T) if coupled else np.abs(T).max(axis=0)
        assert (resultant <= 0.4 * N + ROUND_OFF).all()
        assert np.abs(T[:, apart]).max() < ROUND_OFF
        assert (p.status[:n_tangent, apart] == SEPARATED).all()
        assert (p.status[:n_tangent, ~apart] != SEPARATED).all()
        np.testing.assert_allclose(T, 1.1 * (p.u[:-1] - p.slider), atol=ROUND_OFF)
        if coupled or n_tangent == 1:
            slips = p.status[0] == SLIP
            np.testing.assert_allclose(resultant[slips], 0.4 * N[slips], atol=ROUND_OFF)


@pytest.mark.parametrize("friction", Friction)
def test_without_friction_there_is_no_tangential_force(friction: Friction) -> None:
    p = Prescribed(contact(2, friction_coefficient=0.0, friction=friction), random_motion(3, 0))
    np.testing.assert_allclose(p.force[:2], 0, atol=ROUND_OFF)
    np.testing.assert_allclose(p.coefficients[:, :2], 0, atol=ROUND_OFF)


@pytest.mark.parametrize("friction", Friction)
def test_under_a_great_preload_the_contact_is_two_springs_and_a_normal_spring(friction: Friction) -> None:
    p = Prescribed(contact(2, preload=1e3, gap=0.0, friction=friction), random_motion(3, 0))
    np.testing.assert_allclose(p.force[:2], 1.1 * p.u[:2], atol=ROUND_OFF)
    np.testing.assert_allclose(p.force[2], 1e3 + 2.0 * p.u[2], rtol=ROUND_OFF)
    assert (p.status[:2] == STICK).all()


@pytest.mark.parametrize("friction", Friction)
def test_a_multiplier_is_the_share_of_the_limit_at_the_first_instant(friction: Friction) -> None:
    motion = 0.03 * random_motion(3, 0)
    motion[2, 0] = 1.0
    m = np.array([0.5, -0.3])
    p = Prescribed(contact(2, friction=friction), motion, start=m, multiplier=True)
    np.testing.assert_allclose(p.force[:2, 0], m * 0.4 * p.force[2, 0], atol=ROUND_OFF)  # eq. 11
    # The equivalent slider position gives the same force over the whole period.
    same = Prescribed(contact(2, friction=friction), motion, start=p.u[:2, 0] - m * 0.4 * p.force[2, 0] / 1.1)
    np.testing.assert_allclose(same.force, p.force, atol=ROUND_OFF)
    assert np.abs(Prescribed(contact(2, friction=friction), motion).force[:2] - p.force[:2]).max() > 0.1


@pytest.mark.parametrize("seed", range(6))
def test_a_third_period_changes_nothing(seed: int) -> None:
    joint = contact(1)
    rng = np.random.default_rng(seed)
    p = Prescribed(joint, random_motion(2, seed, mean=rng.uniform(0, 0.6)), start=[rng.uniform(-0.5, 0.5)])
    again = Prescribed(joint, random_motion(2, seed, mean=p.u[1].mean()), start=p.slider[:, -1])
    np.testing.assert_allclose(again.slider, p.slider, atol=ROUND_OFF)
    # Go on from the end of the steady period by eq. 7 as it stands: T = clip(k_t (u - w)).
    w, limit = p.slider[0, -1], 0.4 * p.force[1]
    for k in range(p.u.shape[1]):
        T = np.clip(1.1 * (p.u[0, k] - w), -limit[k], limit[k])
        w = p.u[0, k] - T / 1.1
        assert abs(w - p.slider[0, k]) < ROUND_OFF
        assert abs(T - p.force[0, k]) < ROUND_OFF


# ---- Coulomb friction in two tangents


def circle(radius: float, n_sample: int, friction_coefficient: float) -> Prescribed:
    joint = contact(2, friction=Friction.COULOMB, friction_coefficient=friction_coefficient, preload=1.0, gap=0.0)
    return Prescribed(joint, [[0, radius, 0], [0, 0, radius], [0, 0, 0]], n_sample=n_sample)


def test_on_a_circle_the_slider_follows_on_a_smaller_circle_with_the_full_limit_along_its_path() -> None:
    R, mu = 1.0, 0.44
    r = mu / 1.1  # radius of the limit, mu N / k_t
    p = circle(R, 2048, mu)
    T, w = p.force[:2], p.slider
    np.testing.assert_allclose(np.hypot(*T), mu, rtol=ROUND_OFF)
    # A spring of length r whose end follows a circle stays tangent to the circle of the slider.
    np.testing.assert_allclose(np.hypot(*w), np.sqrt(R**2 - r**2), rtol=1e-5)  # polygons: (2 pi / n)^2
    sliding = np.roll(w, -1, axis=1) - np.roll(w, 1, axis=1)
    along = (T * sliding).sum(axis=0) / (np.hypot(*T) * np.hypot(*sliding))
    np.testing.assert_allclose(along, 1, atol=1e-4)  # the force on the structure opposes the sliding
    coarse = np.hypot(*circle(R, 256, mu).slider).mean() - np.sqrt(R**2 - r**2)
    fine = np.hypot(*circle(R, 1024, mu).slider).mean() - np.sqrt(R**2 - r**2)
    np.testing.assert_allclose(coarse / fine, 16, rtol=0.01)  # second order in the step
    assert (circle(0.9 * r, 256, mu).status[0] == STICK).all()


@pytest.mark.parametrize("seed", range(3))
def test_in_one_tangent_coulomb_friction_is_the_uncoupled_one(seed: int) -> None:
    motion = random_motion(3, seed)
    motion[1] = 0
    coupled = Prescribed(contact(2, friction=Friction.COULOMB), motion)
    alone = Prescribed(contact(1), motion[[0, 2]])
    np.testing.assert_allclose(coupled.force[[0, 2]], alone.force, atol=1e-10)  # iterated until it settles to 1e-11
    np.testing.assert_array_equal(coupled.force[1], 0)
    constant = motion.copy()
    constant[2] = [0.5, *np.zeros(6)]  # N = 1.1
    jenkins = JenkinsElement(name="j", direction=ONE, tangential_stiffness=1.1, limit_force=0.44)
    np.testing.assert_allclose(
        Prescribed(contact(2, friction=Friction.COULOMB), constant).force[0],
        Prescribed(jenkins, motion[0]).force[0],
        atol=1e-10,
    )


def test_coulomb_friction_is_isotropic_and_the_uncoupled_one_is_not() -> None:
    motion, angle = random_motion(3, 1, mean=0.2), 0.6
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = np.vstack([turn @ motion[:2], motion[2:]])
    difference = {}
    for friction in Friction:
        joint = contact(2, friction=friction)
        force, rotated = Prescribed(joint, motion).force[:2], Prescribed(joint, turned).force[:2]
        difference[friction] = np.abs(turn @ force - rotated).max()
    assert difference[Friction.COULOMB] < 1e-9  # settled to 1e-11
    assert difference[Friction.UNCOUPLED] > 1e-2
