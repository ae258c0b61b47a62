"""Two bodies joined along two lines: springs, names, rest against statics, and the system about that rest."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.distributed_load import distribute_load
from fe.element import HEX20
from fe.material import Material
from fe.mesh import Mesh
from fe.mesher.block import Block, Lattice, mesh_blocks
from fe.system import LinearSystem
from geometry.interface import ContactLine, straight_contact_line
from reduction.assembly import ReducedAssembly, reduce_bodies
from reduction.craig_bampton import craig_bampton
from reduction.errors import JointError, RomError
from reduction.joined_bodies import JoinedBodies, LinePair, join_bodies, make_jointed_system
from reduction.line_contact import LineStiffness, Tangents

Array = NDArray[np.float64]

STEEL = Material(young=210e9, poisson=0.3, density=7800)
#: A plate that is held below, and a block on it, along whose lower edges y = 0 and y = 20 mm they touch [m].
PLATE, BLOCK = (np.zeros(3), np.array([0.02, 0.02, 0.01])), (np.array([0.0, 0.0, 0.01]), np.array([0.02, 0.02, 0.02]))
LINES = {"front": 0.0, "back": 0.02}
K_N, K_T = {"front": 8e6, "back": 4e6}, 5e6
POINT, PULL = np.array([0.008, 0.015, 0.05]), 55.0


def box(corner: Array, edges: Array, counts: tuple[int, int, int]) -> Mesh:
    def shape(u: Lattice, v: Lattice, w: Lattice) -> tuple[Lattice, Lattice, Lattice]:
        x, y, z = (a + length * s for a, length, s in zip(corner, edges, (u, v, w), strict=True))
        return x, y, z

    return mesh_blocks([Block(shape=shape, counts=counts, faces={"w0": "below", "w1": "above"})], HEX20)


def edge(name: str) -> ContactLine:
    """On the block: its normal points down into the plate."""
    return straight_contact_line(
        name=name,
        start=np.array([0.0, LINES[name], 0.01]),
        end=np.array([0.02, LINES[name], 0.01]),
        normal=np.array([0.0, 0.0, -1.0]),
        across=np.array([0.0, 1.0, 0.0]),
        n_station=3,
    )


def pair(name: str, gaps: list[float] | None = None) -> LinePair:
    return LinePair(
        name=name, body="block", other="plate", line=edge(name), line_set=f"{name} line", other_set=f"{name} groove",
        stiffness=LineStiffness(normal=K_N[name], tangential=K_T), friction_coefficient=0.6, gaps=gaps,
    )  # fmt: skip


class Stack:
    """Plate and block, reduced."""

    def __init__(self) -> None:
        self.meshes = {"plate": box(*PLATE, (1, 1, 1)), "block": box(*BLOCK, (1, 1, 1))}
        systems, boundary = {}, {}
        for body, mesh in self.meshes.items():
            mass, stiffness = assemble(mesh, STEEL)
            if body == "plate":
                system = supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes("below"))])
            else:
                system = LinearSystem(
                    mass=mass, damping=sp.csr_array(0 * mass), stiffness=stiffness, free=np.arange(3 * mesh.n_node),
                    n_node=mesh.n_node,
                )  # fmt: skip
            systems[body] = system
            kind = "groove" if body == "plate" else "line"
            boundary[body] = {
                f"{name} {kind}": system.rows(
                    np.array([int(np.argmin(np.linalg.norm(mesh.points - p, axis=1))) for p in edge(name).stations])
                )
                for name in LINES
            }
        self.assembly: ReducedAssembly = reduce_bodies(systems, boundary, {"plate": 3, "block": 4})
        mass, stiffness = assemble(self.meshes["plate"], STEEL)
        n_node = self.meshes["plate"].n_node
        free = LinearSystem(mass=mass, damping=0 * mass, stiffness=stiffness, free=np.arange(3 * n_node), n_node=n_node)
        kept = {name: free.rows(systems["plate"].free[rows[::3]] // 3) for name, rows in boundary["plate"].items()}
        #: The plate without its supports.
        self.floating = craig_bampton(free, kept, 3)

    def load(self, force: float, point: Array) -> Array:
        mesh = self.meshes["block"]
        nodal = distribute_load(mesh, mesh.nodes("above"), np.array([0.0, 0.0, force]), point)
        return np.asarray(self.assembly.load("block", nodal))


@pytest.fixture(scope="module")
def stack() -> Stack:
    return Stack()


@pytest.fixture(scope="module")
def both(stack: Stack) -> JoinedBodies:
    return join_bodies(stack.assembly, [pair("front"), pair("back")])


def springs_by_hand(assembly: ReducedAssembly) -> Array:
    """Each station by itself: a quarter, a half and a quarter of its line, along x, y and z."""
    result = np.zeros((assembly.n_dof,) * 2)
    for name in LINES:
        upper = assembly.rows("block", f"{name} line").reshape(-1, 3)
        lower = assembly.rows("plate", f"{name} groove").reshape(-1, 3)
        for station, share in enumerate([0.25, 0.5, 0.25]):
            for axis, k in enumerate([K_T, K_T, K_N[name]]):
                row = np.zeros(assembly.n_dof)
                row[upper[station, axis]], row[lower[station, axis]] = 1.0, -1.0
                result += share * k * np.outer(row, row)
    return result


@pytest.mark.parametrize("tangents", Tangents)
def test_all_stuck_it_is_the_bodies_with_a_spring_at_each_station(stack: Stack, tangents: Tangents) -> None:
    made = join_bodies(stack.assembly, [pair("front"), pair("back")], tangents=tangents)
    expected = springs_by_hand(stack.assembly)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(made.springs, expected, atol=1e-12 * scale)
    # Beside squared frequencies of modal coordinates, which are large, springs keep fewer digits.
    largest = np.abs(stack.assembly.stiffness).max()
    np.testing.assert_allclose(made.stuck, stack.assembly.stiffness + expected, atol=1e-15 * largest + 1e-12 * scale)
    np.testing.assert_array_equal(made.mass, stack.assembly.mass)
    across = made.stiffness - stack.assembly.stiffness
    assert np.any(across) == (tangents is Tangents.ALONG)
    assert {len(item.tangents) for item in made.contacts} == {1 if tangents is Tangents.ALONG else 2}


def test_contacts_are_named_by_line_and_station(both: JoinedBodies) -> None:
    assert both.lines == {name: (f"{name}.1", f"{name}.2", f"{name}.3") for name in LINES}
    assert [item.name for item in both.contacts] == [name for line in both.lines.values() for name in line]
    assert {item.friction_coefficient for item in both.contacts} == {0.6}


@pytest.mark.parametrize("tangents", Tangents)
def test_at_rest_normal_forces_balance_the_weight_and_its_moments(stack: Stack, tangents: Tangents) -> None:
    made = join_bodies(stack.assembly, [pair("front", [0, 1e-7, 0]), pair("back")], tangents=tangents)
    rest = made.static_state(stack.load(-PULL, POINT))
    places = np.vstack([edge(name).stations for name in LINES])
    # Tangential forces lie in the plane of the lines: they have no moment about its axes. Constraint modes know the
    # rigid-body motions to about 1e-10.
    np.testing.assert_allclose(rest.normal.sum(), PULL, rtol=1e-8)
    np.testing.assert_allclose(rest.normal @ places[:, :2], PULL * POINT[:2], rtol=1e-8)
    along = np.array([item[0] for item in rest.tangential])
    np.testing.assert_allclose(along.sum(), 0, atol=1e-8 * PULL)
    assert [item.preload for item in rest.contacts] == list(rest.normal)


def test_a_weight_beyond_one_line_or_upwards_has_no_rest(stack: Stack, both: JoinedBodies) -> None:
    for force, y in ((-PULL, -0.01), (-PULL, 0.03), (PULL, POINT[1])):
        with pytest.raises(JointError, match="under the static load"):
            both.static_state(stack.load(force, np.array([0.01, y, 0.05])))


def test_a_line_that_nothing_presses_is_named(stack: Stack) -> None:
    # A third line on the stations of the second one, too far away to touch.
    third = replace(pair("back", [1e-4] * 3), name="third")
    made = join_bodies(stack.assembly, [pair("front"), pair("back"), third])
    with pytest.raises(JointError, match='under the static load "third" opens along its whole length'):
        made.static_state(stack.load(-PULL, POINT))


def test_gaps_are_those_of_their_line(stack: Stack) -> None:
    made = join_bodies(stack.assembly, [pair("front"), pair("back", [0.0, 1e-6, 2e-6])])
    assert [item.gap for item in made.contacts] == [0, 0, 0, 0, 1e-6, 2e-6]
    with pytest.raises(JointError, match=r'"back" has 3 stations but gaps of shape \(2,\)'):
        join_bodies(stack.assembly, [pair("back", [0.0, 1e-6])])


def test_unknown_sets_and_bodies_are_refused(stack: Stack) -> None:
    with pytest.raises(RomError, match='no boundary set "front lin"'):
        join_bodies(stack.assembly, [replace(pair("front"), line_set="front lin")])
    with pytest.raises(RomError, match='no body "plat": it has plate, block'):
        join_bodies(stack.assembly, [replace(pair("front"), other="plat")])


def test_sets_with_another_number_of_nodes_than_stations_are_refused(stack: Stack) -> None:
    whole = edge("front")
    two = straight_contact_line(
        name="front", start=whole.stations[0], end=whole.stations[-1], normal=whole.normal[0],
        across=np.array([0.0, 1.0, 0.0]), n_station=2,
    )  # fmt: skip
    with pytest.raises(
        JointError, match='"front line" of block keeps 9 degrees of freedom, but the line has 2 stations'
    ):
        join_bodies(stack.assembly, [replace(pair("front"), line=two)])


def test_two_pairs_of_one_name_are_refused(stack: Stack) -> None:
    with pytest.raises(JointError, match='two pairs of lines are called "front"'):
        join_bodies(stack.assembly, [pair("front"), replace(pair("back"), name="front")])


def test_bodies_with_damping_of_their_own_are_refused(stack: Stack) -> None:
    bodies = stack.assembly.bodies
    damped = replace(bodies["block"], damping=bodies["block"].mass)
    with pytest.raises(JointError, match="the bodies already have damping, which would be lost"):
        join_bodies(ReducedAssembly(bodies={**bodies, "block": damped}), [pair("front")])


def test_the_system_about_rest_has_the_loads_and_the_ratio(stack: Stack, both: JoinedBodies) -> None:
    rest = both.static_state(stack.load(-PULL, POINT))
    force = np.zeros((2, stack.assembly.n_dof), dtype=np.complex128)
    force[1, stack.assembly.rows("block", "back line", 1)] = 1 + 2j
    system = make_jointed_system(both, rest, 0.004, force)
    np.testing.assert_array_equal(system.dynamic, force)
    np.testing.assert_array_equal(system.static, rest.load)
    np.testing.assert_array_equal(system.stiffness, both.stiffness)
    assert tuple(system.joints) == rest.contacts
    lambda_, shapes = scipy.linalg.eigh(both.stuck, both.mass)
    # The lowest mode rocks along x, square to this force, by symmetry: the next one counts.
    seen = np.abs(force[1] @ shapes)
    assert seen[0] < 1e-6 * seen[1]
    damping = shapes[:, 1] @ system.damping @ shapes[:, 1]
    np.testing.assert_allclose(damping, 2 * 0.004 * np.sqrt(lambda_[1]), rtol=1e-6)
    # Contacts that slide or open have no part in it; what holds second tangents has, which uncouples the modes without.
    bodies = np.column_stack([both.mass.ravel(), both.stiffness.ravel()])
    factors, *_ = np.linalg.lstsq(bodies / np.abs(bodies).max(axis=0), system.damping.ravel(), rcond=None)
    rebuilt = bodies / np.abs(bodies).max(axis=0) @ factors
    np.testing.assert_allclose(rebuilt, system.damping.ravel(), atol=1e-9 * np.abs(system.damping).max())


def test_forces_in_opposition_damp_the_mode_that_they_drive(stack: Stack, both: JoinedBodies) -> None:
    rest = both.static_state(stack.load(-PULL, POINT))
    lambda_, shapes = scipy.linalg.eigh(both.stuck, both.mass)
    # Inertia forces of the third mode and the fifth one: their parts on the first two cancel, those of their sizes
    # alone would not.
    force = np.zeros((2, stack.assembly.n_dof), dtype=np.complex128)
    force[1] = both.mass @ (shapes[:, 2] + shapes[:, 4])
    assert np.abs(np.abs(force[1]) @ shapes[:, :2]).max() > 0.01
    damping = make_jointed_system(both, rest, 0.004, force).damping
    np.testing.assert_allclose(shapes[:, 2] @ damping @ shapes[:, 2], 2 * 0.004 * np.sqrt(lambda_[2]), rtol=1e-6)


def test_what_joins_and_how_it_rests_cannot_be_written(stack: Stack, both: JoinedBodies) -> None:
    rest = both.static_state(stack.load(-PULL, POINT))
    for values in (both.mass, both.bodies, both.stiffness, both.springs, rest.displacement, rest.load, rest.normal):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0.0
    for force in rest.tangential:
        with pytest.raises(ValueError, match="read-only"):
            force[0] = 0.0
    with pytest.raises(TypeError):
        both.lines["front"] = ()  # type: ignore[index]
    mass = np.array(both.mass)
    copied = replace(both, mass=mass)
    mass[0, 0] = -1.0
    assert copied.mass[0, 0] == both.mass[0, 0]


def test_bodies_that_nothing_supports_are_named(stack: Stack) -> None:
    loose = ReducedAssembly(bodies={**stack.assembly.bodies, "wedge": stack.assembly.bodies["block"]})
    with pytest.raises(
        JointError, match=r"^wedge is not supported: give it a support, or contact with a body that has one"
    ):
        join_bodies(loose, [pair("front"), pair("back")])
    floating = ReducedAssembly(bodies={body: stack.floating if body == "plate" else rom
                                       for body, rom in stack.assembly.bodies.items()})  # fmt: skip
    with pytest.raises(
        JointError, match=r"^plate and block, which touch each other, are not supported: give one of them a"
    ):
        join_bodies(floating, [pair("front"), pair("back")])
