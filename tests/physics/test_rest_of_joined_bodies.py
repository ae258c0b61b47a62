"""Bodies pressed together by a dead weight, solved about their rest: without excitation nothing moves."""

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from fe.distributed_load import distribute_load
from fe.mesh import Mesh
from geometry.interface import straight_contact_line
from hbsolve.balance import HarmonicBalance
from hbsolve.contact_motion import contact_motion
from hbsolve.steady_state import steady_state
from reduction.assembly import ReducedAssembly
from reduction.joined_bodies import JoinedBodies, LinePair, join_bodies, make_jointed_system
from reduction.line_contact import LineStiffness, Tangents
from reduction.rom import ReducedModel
from reduction.static_contact import StaticState
from reduction.stuck import stuck_stiffness

Array = NDArray[np.float64]

#: Corners of a cube of 1 m, the lower four first; and the tops of four posts below those, along the edges y = 0, 1.
CUBE = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
WEIGHT, PLACE = np.array([0.3, 0.2, -50.0]), np.array([0.8, 0.85, 2.0])
OMEGA = 300.0


def body(mass: Array, stiffness: Array, sets: dict[str, list[int]]) -> ReducedModel:
    """A body of nodes alone, with nothing between them to be reduced."""
    n = len(mass)
    return ReducedModel(
        mass=mass, damping=0 * mass, stiffness=stiffness, boundary_node=np.arange(n) // 3,
        boundary_direction=np.arange(n) % 3,
        boundary_sets={name: (3 * np.array(nodes)[:, None] + np.arange(3)).ravel() for name, nodes in sets.items()},
        fixed_interface_frequency=np.zeros(0), recovery=np.eye(n), free=np.arange(n), n_node=n // 3,
    )  # fmt: skip


def truss() -> Array:
    """Bars between all corners of the cube."""
    result = np.zeros((24, 24))
    for i, j in combinations(range(8), 2):
        row = np.zeros(24)
        row[3 * i : 3 * i + 3], row[3 * j : 3 * j + 3] = CUBE[i] - CUBE[j], CUBE[j] - CUBE[i]
        result += 1e6 * np.outer(row, row) / (row @ row)
    return result


def bodies(tangents: Tangents) -> tuple[JoinedBodies, StaticState]:
    sets = {"front": [0, 1], "back": [2, 3]}
    assembly = ReducedAssembly(
        bodies={
            "posts": body(0.5 * np.eye(12), np.diag(1e6 * np.arange(2.0, 14.0)), sets),
            "cube": body(np.eye(24), truss(), sets),
        }
    )
    pairs = [
        LinePair(
            name=name, body="cube", other="posts", line_set=name, other_set=name, friction_coefficient=0.8,
            stiffness=LineStiffness(normal=3e6, tangential=2e6),
            line=straight_contact_line(
                name=name, start=CUBE[nodes[0]], end=CUBE[nodes[1]], normal=np.array([0.0, 0.0, -1.0]),
                across=np.array([0.0, 1.0, 0.0]), n_station=2,
            ),
        )
        for name, nodes in sets.items()
    ]  # fmt: skip
    made = join_bodies(assembly, pairs, tangents=tangents)
    mesh = Mesh(points=CUBE, cells={})
    return made, made.static_state(assembly.load("cube", distribute_load(mesh, np.arange(4, 8), WEIGHT, PLACE)))


def sliders(rest: StaticState) -> Array:
    """Where the sliders are when springs without tension were loaded."""
    parts = zip(rest.contacts, rest.tangential, strict=True)
    return np.concatenate([-force / item.tangential_stiffness for item, force in parts])


@pytest.fixture(scope="module", params=Tangents, ids=lambda tangents: str(tangents.value))
def loaded(request: pytest.FixtureRequest) -> tuple[JoinedBodies, StaticState]:
    return bodies(request.param)


def balance_at(loaded: tuple[JoinedBodies, StaticState], level: float) -> HarmonicBalance:
    made, rest = loaded
    force = np.zeros((2, len(made.mass)), dtype=np.complex128)
    force[1] = np.random.default_rng(2).standard_normal(len(made.mass))
    return HarmonicBalance(system=make_jointed_system(made, rest, 0.01, force), n_harmonic=3, level=level)


def test_the_weight_opens_one_corner_and_slides_none(loaded: tuple[JoinedBodies, StaticState]) -> None:
    _, rest = loaded
    assert (rest.normal > 0).tolist() == [False, True, True, True]
    assert 0.01 < rest.ratio.max() < 0.9


def test_rest_is_rest(loaded: tuple[JoinedBodies, StaticState]) -> None:
    _, rest = loaded
    balance = balance_at(loaded, 0.0)
    state = steady_state(balance, OMEGA, slider=sliders(rest))
    # The solver stops at 1e-9 of the linear motion, which is of the size of the static displacement.
    assert np.abs(state.coefficients).max() < 1e-8 * np.abs(rest.displacement).max()
    for motion, N, T in zip(contact_motion(balance, state), rest.normal, rest.tangential, strict=True):
        n_sample = motion.time.size
        expected = np.tile(np.append(T, N)[:, None], n_sample)
        np.testing.assert_allclose(motion.force, expected, atol=1e-6 * np.abs(WEIGHT).max())


def test_a_small_force_moves_it_as_if_stuck_where_it_is_closed(loaded: tuple[JoinedBodies, StaticState]) -> None:
    made, rest = loaded
    level = 1e-3
    balance = balance_at(loaded, level)
    state = steady_state(balance, OMEGA, slider=sliders(rest))
    closed = [item for item, N in zip(rest.contacts, rest.normal, strict=True) if N > 0]
    dynamic = stuck_stiffness(made.stiffness, closed) + 1j * OMEGA * balance.system.damping - OMEGA**2 * made.mass
    expected = np.linalg.solve(dynamic, level * balance.system.dynamic[1])
    scale = np.abs(expected).max()
    np.testing.assert_allclose(state.coefficients[1], expected, atol=1e-4 * scale)
    np.testing.assert_allclose(state.coefficients[[0, 2]], 0, atol=1e-4 * scale)
