"""Static equilibrium with contacts against linear solutions, complementarity problems and the laws themselves."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    JointedSystem,
)
from transient.equilibrium import equilibrium
from transient.integrate import integrate
from transient.joint_arrays import make_joint_table
from transient.state import TransientState
from transient.state_transition import ModalStructure, decompose, make_modal_structure
from transient.virtual_bench.beam import Beam, BeamParameters, contacts, jointed_beam, reduced_beam
from transient.virtual_bench.campaign import random_parameters

Vector = NDArray[np.float64]


def in_modes(system: JointedSystem, share: float) -> ModalStructure:
    """The structure in the modes with a share of its joints' stiffnesses."""
    table = make_joint_table(system)
    return replace(decompose(system, table, share * table.stuck_stiffness), diagonal=False)


def assembled(beam: Beam, parameters: BeamParameters) -> Vector:
    """Displacement with closed, sticking contacts."""
    system = jointed_beam(beam, parameters)
    stiffness, load = system.stiffness.copy(), system.static.copy()
    for joint in contacts(beam, parameters):
        stiffness += joint.normal_stiffness * np.outer(joint.normal, joint.normal)
        stiffness += joint.tangential_stiffness * joint.tangents.T @ joint.tangents
        load -= (joint.preload - joint.normal_stiffness * joint.gap) * joint.normal
    return np.linalg.solve(stiffness, load)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_preloads_in_balance_leave_the_assembled_specimen_in_any_modes(share: float, gap: float) -> None:
    random, beam = np.random.default_rng(0), reduced_beam()
    for _ in range(120):
        parameters = replace(random_parameters(random), gap=(0.0, gap))
        state = equilibrium(in_modes(jointed_beam(beam, parameters), share))
        exact = assembled(beam, parameters)
        # Round-off of a stiffness whose condition is 1e8, and of the 6e-6 m by which a preload moves a contact.
        np.testing.assert_allclose(state.displacement, exact, rtol=0, atol=1e-8 * abs(exact).max() + 1e-16)
        assert not state.slider.any()


def test_a_balanced_specimen_stays_at_rest_without_excitation() -> None:
    random, beam = np.random.default_rng(0), reduced_beam()
    for _ in range(20):
        system = jointed_beam(beam, replace(random_parameters(random), gap=(0.0, 0.0)))
        final = integrate(system, 2 * np.pi * 468.0, 2, 128, level=0.0).final
        # Nothing but round-off of the 6e-6 m by which a preload moves a contact.
        assert np.abs(final.displacement).max() < 1e-15


def unilateral(random: np.random.Generator) -> JointedSystem:
    """Five frictionless contacts, some preloaded, some with a gap or held open, under a load that opens some."""
    n = 6
    factor = random.standard_normal((n, n))
    joints = [
        FrictionContact(
            name=f"{number}",
            tangents=random.standard_normal((1, n)),
            normal=random.standard_normal(n),
            normal_stiffness=10 ** random.uniform(0, 3),
            tangential_stiffness=10.0,
            friction_coefficient=0.0,
            preload=random.choice([-1.0, 0.0, 2.0]),
            gap=random.choice([-0.1, 0.0, 0.1]),
        )
        for number in range(5)
    ]
    return JointedSystem(
        mass=np.eye(n),
        damping=np.zeros((n, n)),
        stiffness=factor @ factor.T + 0.1 * np.eye(n),
        joints=joints,
        static_load=3 * random.standard_normal(n),
    )


def test_contacts_without_friction_minimise_the_potential_energy() -> None:
    n_open = []
    for seed in range(60):
        system = unilateral(np.random.default_rng(seed))
        normals = np.array([joint.normal for joint in system.joints])
        stiffness = np.array([joint.normal_stiffness for joint in system.joints])
        first = np.array([joint.preload - joint.normal_stiffness * joint.gap for joint in system.joints])
        result = []
        # The energy is convex, so that one set of closed contacts alone fits: all are tried.
        for closed in product([False, True], repeat=5):
            b, k, f = normals[[*closed]], stiffness[[*closed]], first[[*closed]]
            q = np.linalg.solve(system.stiffness + b.T @ (k[:, None] * b), system.static - b.T @ f)
            if ((first + stiffness * (normals @ q) > 0) == closed).all():
                result.append((q, closed))
        assert len(result) == 1
        # Positions are accepted at 1e-10 of the largest one, and stiffnesses differ by 1e4.
        np.testing.assert_allclose(equilibrium(system).displacement, result[0][0], atol=1e-7 * abs(result[0][0]).max())
        n_open.append(5 - sum(result[0][1]))
    assert min(n_open) == 0
    assert max(n_open) >= 4


#: How many of the chain's masses slide under a pull.
N_SLIDING = {0.5: 0, 1.5: 1, 2.5: 2, 4.0: 3, 8.0: 4}


@pytest.mark.parametrize("load", list(N_SLIDING))
def test_a_chain_pulled_beyond_coulombs_limit_equals_its_complementarity_problem(load: float) -> None:
    # Four masses in a chain, each on a table of its own preload; all slide one way as the pull grows, so that the
    # sliders of the ramp are those of the one problem: stick with w = 0, or slide with T = mu N.
    n, tangential, friction = 4, 5.0, 0.4
    weights = np.array([1.0, 2.0, 1.5, 3.0])
    # N = N_0 + k_n (v - g) and k v = p - N with k = 2, k_n = 6, p = 1, g = 0.1.
    normal = weights + 6.0 * ((1.0 - weights + 0.6) / 8.0 - 0.1)
    chain = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    force = load * np.array([0.0, 0.0, 0.0, 1.0])
    joints = [
        FrictionContact(
            name=f"{number}",
            tangents=np.eye(2 * n)[number],
            normal=np.eye(2 * n)[n + number],
            normal_stiffness=6.0,
            tangential_stiffness=tangential,
            friction_coefficient=friction,
            preload=weight,
            gap=0.1,
        )
        for number, weight in enumerate(weights)
    ]
    system = JointedSystem(
        mass=np.eye(2 * n),
        damping=np.zeros((2 * n, 2 * n)),
        stiffness=np.block([[chain, np.zeros((n, n))], [np.zeros((n, n)), 2.0 * np.eye(n)]]),
        joints=joints,
        static_load=np.concatenate([force, np.ones(n)]),
    )
    limit, result = friction * normal, []
    for slides in product([False, True], repeat=n):
        stuck = ~np.array(slides)
        q = np.linalg.solve(chain + tangential * np.diag(stuck), force - np.where(stuck, 0.0, limit))
        slider = np.where(stuck, 0.0, q - limit / tangential)
        if (slider >= 0).all() and (np.abs(tangential * q[stuck]) <= limit[stuck]).all():
            result.append((q, slider))
    assert len(result) == 1
    state = equilibrium(system)
    # Fifty parts add their round-off.
    np.testing.assert_allclose(state.displacement[:n], result[0][0], atol=1e-11)
    np.testing.assert_allclose(state.slider, result[0][1], atol=1e-11)
    assert int(np.sum(result[0][1] > 0)) == N_SLIDING[load]


def mixed(random: np.random.Generator) -> JointedSystem:
    """Joints of all kinds in random directions; in half of the systems the load balances the preloads."""
    n = int(random.integers(4, 9))
    factor = random.standard_normal((n, n))
    joints: list[FrictionContact | ElasticStop | CubicSpring | JenkinsElement] = [
        FrictionContact(
            name=f"{number}",
            tangents=random.standard_normal((int(random.integers(1, 3)), n)),
            normal=random.standard_normal(n),
            normal_stiffness=10 ** random.uniform(-1, 3),
            tangential_stiffness=10 ** random.uniform(-1, 3),
            friction_coefficient=random.uniform(0, 0.8),
            preload=random.choice([0.0, 1.0, 5.0]),
            gap=random.choice([0.0, 0.1, -0.1]),
            friction=random.choice(list(Friction)),
        )
        for number in range(int(random.integers(1, 5)))
    ]
    load = random.standard_normal(n) * 10 ** random.uniform(-1, 1.5)
    if random.uniform() < 0.5:
        load = 0.1 * load + sum(joint.preload * joint.normal for joint in joints if isinstance(joint, FrictionContact))
    joints += [
        ElasticStop(name="stop", direction=random.standard_normal(n), stiffness=100.0, gap=0.05),
        CubicSpring(name="cubic", direction=random.standard_normal(n), stiffness=3.0),
        JenkinsElement(name="j", direction=random.standard_normal(n), tangential_stiffness=30.0, limit_force=0.5),
    ]
    return JointedSystem(
        mass=np.eye(n),
        damping=0.1 * np.eye(n),
        stiffness=(factor @ factor.T + 0.05 * np.eye(n)) * 10 ** random.uniform(-1, 1),
        joints=joints,
        static_load=load,
    )


def violation(system: JointedSystem, state: TransientState) -> float:
    """Largest unbalanced force, or friction force beyond its limit, relative to the forces at play."""
    q, sliders = state.displacement, list(state.slider)
    rest = system.static - system.stiffness @ q
    beyond, size = 0.0, np.abs(system.static).max() + np.abs(system.stiffness @ q).max()
    for joint in system.joints:
        if isinstance(joint, FrictionContact):
            normal = max(joint.preload + joint.normal_stiffness * (joint.normal @ q - joint.gap), 0.0)
            w = np.array([sliders.pop(0) for _ in joint.tangents])
            tangential = joint.tangential_stiffness * (joint.tangents @ q - w)
            norm = 2 if joint.friction is Friction.COULOMB else np.inf
            beyond = max(beyond, np.linalg.norm(tangential, norm) - joint.friction_coefficient * normal)
            rest = rest - normal * joint.normal - tangential @ joint.tangents
            size += normal
        elif isinstance(joint, JenkinsElement):
            force = joint.tangential_stiffness * (joint.direction @ q - sliders.pop(0))
            beyond, rest = max(beyond, abs(force) - joint.limit_force), rest - force * joint.direction
        elif isinstance(joint, ElasticStop):
            rest = rest - joint.stiffness * max(joint.direction @ q - joint.gap, 0.0) * joint.direction
        else:
            assert isinstance(joint, CubicSpring)
            rest = rest - joint.stiffness * (joint.direction @ q) ** 3 * joint.direction
    return float(max(np.abs(rest).max(), beyond) / size)


def test_every_random_system_comes_to_a_rest_that_obeys_the_laws() -> None:
    # Positions are accepted at 1e-10 of the largest one, and stiffnesses differ by up to 1e4.
    assert max(violation(s, equilibrium(s)) for s in map(mixed, map(np.random.default_rng, range(300)))) < 1e-7


def test_the_rest_is_where_an_integration_stays() -> None:
    for seed in range(10):
        system = mixed(np.random.default_rng(seed))
        state = equilibrium(make_modal_structure(system))
        final = integrate(system, 1.0, 1, 512, state).final
        # Kinks of a contact that just touches or slips amplify the 1e-10 of the positions.
        np.testing.assert_allclose(final.displacement, state.displacement, atol=1e-7 * abs(state.displacement).max())
