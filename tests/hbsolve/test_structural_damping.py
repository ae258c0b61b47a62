"""Structural damping: a complex stiffness in the balance of each harmonic but the mean."""

import numpy as np
import pytest
import scipy.sparse as sp

from geometry.errors import InputError
from hbsolve.backbone.backbone import backbone
from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.response import frequency_response
from hbsolve.energy import energy_balance
from hbsolve.errors import DampingWarning
from hbsolve.stability.stability import stability
from hbsolve.steady_state import steady_state
from reduction.jointed_system import FrictionContact, JenkinsElement, JointedSystem, modal_damping
from reduction.nlvib import save_nlvib
from transient.steady import steady_motion

MASS = np.diag([2.0, 1.0, 1.5])
STIFFNESS = 1e4 * np.array([[3.0, -1, 0], [-1, 2, -1], [0, -1, 2]])
FORCE = np.array([[0, 0, 0], [10.0, 0, 0], [0, 0, 2j]])
ETA = 0.03
RUB = FrictionContact(
    name="rub",
    tangents=np.array([0.0, 0, 1]),
    normal=np.array([0.0, 1, 0]),
    tangential_stiffness=1e4,
    normal_stiffness=1e4,
    friction_coefficient=0.4,
    preload=5.0,
)


def chain(**changes: object) -> JointedSystem:
    given = {
        "mass": MASS, "damping": np.zeros((3, 3)), "stiffness": (1 + 1j * ETA) * STIFFNESS,
        "static_load": [0, 5.0, 0], "harmonic_force": FORCE,
    }  # fmt: skip
    return JointedSystem(**{**given, **changes})  # type: ignore[arg-type]


def test_a_single_mass_has_the_amplitude_of_the_closed_form() -> None:
    """|q| = (F / k) / sqrt((1 - r^2)^2 + eta^2): at r = 1 it is F / (eta k), whatever the frequency is."""
    k, m, force = 4e4, 1.0, 3.0
    system = JointedSystem(
        mass=[[m]], damping=[[0.0]], stiffness=[[(1 + 1j * ETA) * k]], harmonic_force=[[0], [force]], static_load=[8.0]
    )
    balance = HarmonicBalance(system=system, n_harmonic=2)
    for ratio in (0.3, 1.0, 1.7):
        state = steady_state(balance, ratio * np.sqrt(k / m))
        expected = force / k / (1 - ratio**2 + 1j * ETA)
        # Round-off beside the largest term, 1 / eta.
        assert state.coefficients[1, 0] == pytest.approx(expected, rel=1e-12)
        # The mean is that of the real stiffness.
        assert state.coefficients[0, 0] == pytest.approx(8.0 / k, rel=1e-12)
        energy = energy_balance(balance, state)
        # pi eta k |q|^2 in a cycle, which no frequency changes.
        assert energy.linear_dissipation == pytest.approx(np.pi * ETA * k * abs(expected) ** 2, rel=1e-12)
        assert energy.input_work == pytest.approx(energy.dissipated, rel=1e-9)
    assert modal_damping(system, np.array([[1.0]]), np.array([200.0]))[0] == pytest.approx(ETA * 200.0)


@pytest.mark.parametrize("hysteresis", [ETA * STIFFNESS, np.diag([900.0, 0, 40.0])], ids=["proportional", "local"])
@pytest.mark.parametrize("damping", [0 * MASS, 3 * MASS, np.diag([0, 30.0, 0])], ids=["none", "mass", "local"])
def test_every_way_of_solving_is_the_direct_solution(hysteresis: np.ndarray, damping: np.ndarray) -> None:
    """Modes that uncouple, modes without the contact springs, and dense solves."""
    system = chain(stiffness=STIFFNESS, structural_damping=hysteresis, damping=damping, joints=[RUB], static_load=None)
    balance, omega = HarmonicBalance(system=system, n_harmonic=4), 90.0
    condensed, B = balance.at_with_slopes(omega), balance.structure.directions
    stuck = STIFFNESS + B.T @ (balance.table.reference[:, None] * B)
    step = 1e-4
    for k in range(1, 4):
        dynamic = stuck - (k * omega) ** 2 * MASS + 1j * (k * omega * damping + hysteresis)
        expected = B @ np.linalg.solve(dynamic, B.T)
        # Two ways to solve for three degrees of freedom: round-off.
        np.testing.assert_allclose(condensed.receptance[k], expected, rtol=1e-9, atol=1e-18)
        ends = [balance.at(omega + way).receptance[k] for way in (step, -step)]
        assert condensed.slopes is not None
        # Central differences: their round-off is 1e-16 / 1e-6 of the receptance.
        difference = (ends[0] - ends[1]) / (2 * step)
        np.testing.assert_allclose(
            condensed.slopes.columns[k].T, difference, rtol=0, atol=1e-7 * np.abs(difference).max()
        )
    state = steady_state(balance, omega)
    work = energy_balance(balance, state)
    # Newton's method leaves 1e-9 of the motion.
    assert work.input_work == pytest.approx(work.dissipated, rel=1e-6)


def test_with_friction_and_one_harmonic_it_is_viscous_damping_of_that_frequency() -> None:
    """H = omega C at the first harmonic; the time integration of the viscous system is the same motion."""
    omega, jenkins = 85.0, JenkinsElement(name="slip", direction=[0, 0, 1], tangential_stiffness=1e4, limit_force=4.0)
    force = FORCE[:2]
    viscous = chain(
        stiffness=STIFFNESS, damping=ETA * STIFFNESS / omega, harmonic_force=force, joints=[jenkins], static_load=None
    )
    structural = chain(harmonic_force=force, joints=[jenkins], static_load=None)
    states = [steady_state(HarmonicBalance(system=item, n_harmonic=2), omega) for item in (viscous, structural)]
    # Both balances have the same equations: what is left are the ends of two iterations.
    np.testing.assert_allclose(states[1].coefficients, states[0].coefficients, rtol=0, atol=1e-9)
    linear = steady_state(HarmonicBalance(system=chain(harmonic_force=force, static_load=None), n_harmonic=2), omega)
    assert np.abs(linear.coefficients - states[1].coefficients).max() > 0.1 * np.abs(states[1].coefficients).max()
    motion = steady_motion(viscous, omega).coefficients(2)
    # One harmonic leaves out what friction makes of the others: a few per cent of this motion.
    assert np.abs(motion[1] - states[1].coefficients[1]).max() < 0.05 * np.abs(motion[1]).max()


def test_curves_end_where_they_should_and_show_the_loss_factor() -> None:
    """The half-power band of a lightly damped mode is eta wide, relative to its frequency."""
    system = JointedSystem(
        mass=[[1.0]], damping=[[0.0]], stiffness=[[1e4 * (1 + 1j * ETA)]], harmonic_force=[[0], [1.0]]
    )
    curve = frequency_response(HarmonicBalance(system=system, n_harmonic=2), 90.0, 110.0, step=0.02)
    amplitude = curve.amplitude(0)
    above = curve.angular_frequency[amplitude >= amplitude.max() / np.sqrt(2)]
    # sqrt(1 + eta) - sqrt(1 - eta) = eta to eta^3, and a point on either side.
    assert np.ptp(above) / 100.0 == pytest.approx(ETA, abs=5e-4)


def test_complex_stiffness_and_sparse_matrices_are_the_same_system() -> None:
    dense = chain()
    other = chain(
        mass=sp.csr_array(MASS), damping=sp.coo_array((3, 3)), stiffness=sp.csc_matrix((1 + 1j * ETA) * STIFFNESS)
    )
    third = chain(stiffness=STIFFNESS, structural_damping=sp.csr_array(ETA * STIFFNESS))
    for item in (other, third):
        for name in ("mass", "damping", "stiffness", "structural_damping"):
            np.testing.assert_array_equal(getattr(item, name), getattr(dense, name))
    assert chain(stiffness=STIFFNESS + 0j).structural_damping is None


def test_what_has_no_complex_stiffness_refuses_it_in_a_sentence(tmp_path: object) -> None:
    balance = HarmonicBalance(system=chain(), n_harmonic=3)
    state = steady_state(balance, 50.0)
    refused = {
        "stability": lambda: stability(balance, state),
        "backbone": lambda: backbone(balance, 1, 1e-6, 1e-3),
        "integration": lambda: steady_motion(balance.system, 50.0),
        "NLvib": lambda: save_nlvib(chain(static_load=None, harmonic_force=FORCE[:2]), f"{tmp_path}/system.mat"),
    }
    for call in refused.values():
        with pytest.raises(InputError, match=r"structural damping \(a complex stiffness\).*viscous damping"):
            call()  # type: ignore[no-untyped-call]


def test_structural_damping_that_feeds_energy_in_is_warned_of() -> None:
    with pytest.warns(DampingWarning, match="the structural damping has the eigenvalue -"):
        HarmonicBalance(system=chain(stiffness=(1 - 1j * ETA) * STIFFNESS), n_harmonic=3)
