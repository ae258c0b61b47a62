"""How springs hold a block, against the six equations of motion of a rigid brick written by hand."""

from collections.abc import Sequence

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.material import Material
from fe.mesh import Mesh
from fe.mesher.block import Block, Lattice, mesh_blocks
from fe.system import LinearSystem
from reduction.assembly import ReducedAssembly, reduce_bodies
from reduction.errors import RomError
from reduction.rigid_body import MOTIONS, RigidBody, check_supported, make_rigid_body

Array = NDArray[np.float64]

STEEL = Material(young=210e9, poisson=0.3, density=7800)
#: One corner of the brick, away from the origin, and its edges [m].
CORNER, EDGES = np.array([0.10, -0.05, 0.02]), np.array([0.03, 0.02, 0.01])
CENTRE = CORNER + EDGES / 2
MASS = 7800 * float(np.prod(EDGES))
INERTIA = (
    MASS / 12 * np.array([EDGES[1] ** 2 + EDGES[2] ** 2, EDGES[0] ** 2 + EDGES[2] ** 2, EDGES[0] ** 2 + EDGES[1] ** 2])
)
X, Y, Z = np.eye(3)


def box(corner: Array, edges: Array, counts: tuple[int, int, int]) -> Mesh:
    def shape(u: Lattice, v: Lattice, w: Lattice) -> tuple[Lattice, Lattice, Lattice]:
        x, y, z = (a + length * s for a, length, s in zip(corner, edges, (u, v, w), strict=True))
        return x, y, z

    return mesh_blocks([Block(shape=shape, counts=counts, faces={"u0": "left"})], HEX20)


class Held:
    """A supported beam, then the brick, which keeps its fixed-interface modes."""

    def __init__(self) -> None:
        beam, self.brick = box(np.zeros(3), np.array([0.1, 0.005, 0.005]), (4, 1, 1)), box(CORNER, EDGES, (1, 1, 1))
        self.meshes = {"beam": beam, "brick": self.brick}
        systems = {}
        for body, mesh in self.meshes.items():
            mass, stiffness = assemble(mesh, STEEL)
            systems[body] = LinearSystem(
                mass=mass, damping=sp.csr_array(0 * mass), stiffness=stiffness, free=np.arange(3 * mesh.n_node),
                n_node=mesh.n_node,
            )  # fmt: skip
            if body == "beam":
                systems[body] = supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes("left"))])
        tip = np.flatnonzero(np.isclose(beam.points[:, 0], 0.1))
        # All corners, and two nodes between them.
        share = (self.brick.points - CORNER) / EDGES
        corner = np.isclose(share, np.round(share), atol=1e-9).all(axis=1)
        self.kept = np.concatenate([np.flatnonzero(corner), np.flatnonzero(~corner)[[1, 6]]])
        boundary = {
            "beam": {"tip": systems["beam"].rows(tip)},
            "brick": {"all": systems["brick"].rows(self.kept)},
        }
        self.assembly: ReducedAssembly = reduce_bodies(systems, boundary, {"beam": 8, "brick": 5})

    def springs(self, parts: Sequence[tuple[int, Array, float]]) -> tuple[Array, Array]:
        """Stiffness of springs at kept nodes along directions; and on the six motions about the centre, by hand."""
        matrix, six = np.zeros((self.assembly.n_dof,) * 2), np.zeros((6, 6))
        for number, direction, k in parts:
            row = np.zeros(self.assembly.n_dof)
            row[self.assembly.rows("brick", "all").reshape(-1, 3)[number]] = direction
            matrix += k * np.outer(row, row)
            arm = self.brick.points[self.kept[number]] - CENTRE
            moves = np.concatenate([direction, np.cross(arm, direction)])
            six += k * np.outer(moves, moves)
        return matrix, six

    def body(self, springs: Array) -> RigidBody:
        return make_rigid_body(self.assembly, "brick", self.brick.points, springs)

    def corners(self, axes: Sequence[int]) -> list[int]:
        """Kept corners whose coordinates along some axes are the lowest."""
        share = (self.brick.points[self.kept[:8]] - CORNER) / EDGES
        return [int(i) for i in np.flatnonzero(np.isclose(share[:, list(axes)], 0, atol=1e-9).all(axis=1))]


@pytest.fixture(scope="module")
def held() -> Held:
    return Held()


@pytest.mark.parametrize("seed", range(4))
def test_a_brick_on_springs_is_the_six_equations_of_a_brick(held: Held, seed: int) -> None:
    rng = np.random.default_rng(seed)
    parts = [(int(n), rng.standard_normal(3), float(1e6 * rng.uniform(0.1, 3))) for n in rng.integers(0, 10, 9)]
    springs, six = held.springs(parts)
    # A spring on another body is none of the brick's.
    beam = held.assembly.rows("beam", "tip")
    springs[beam, beam] += 1e9
    result = held.body(springs)
    # The element holds a brick's mass and inertia without error; constraint modes are as good as their solver.
    np.testing.assert_allclose(result.mass, MASS, rtol=1e-9)
    np.testing.assert_allclose(result.centre, CENTRE, rtol=1e-9)
    np.testing.assert_allclose(result.stiffness, np.diag(six), rtol=1e-8)
    inertia = np.diag([MASS, MASS, MASS, *INERTIA])
    lambda_ = scipy.linalg.eigh(six, inertia, eigvals_only=True)
    np.testing.assert_allclose((2 * np.pi * result.frequency) ** 2, lambda_, rtol=1e-7, atol=1e-9 * lambda_[-1])
    np.testing.assert_allclose(result.shape.T @ inertia @ result.shape, np.eye(6), atol=1e-8)
    np.testing.assert_allclose(result.shape.T @ six @ result.shape, np.diag(lambda_), atol=1e-8 * lambda_[-1])
    assert result.free == ()
    check_supported([result])


def test_springs_at_the_corners_resist_as_a_table_does(held: Held) -> None:
    # Four legs of 1e6 N/m below the corners of the bottom, each along x, y and z, at half the height below the centre.
    corners = held.corners([2])
    assert len(corners) == 4
    springs, _ = held.springs([(n, d, 1e6) for n in corners for d in (X, Y, Z)])
    a, b, c = EDGES / 2
    expected = 4e6 * np.array([1, 1, 1, b**2 + c**2, a**2 + c**2, a**2 + b**2])
    np.testing.assert_allclose(held.body(springs).stiffness, expected, rtol=1e-8)


def test_stations_on_one_line_leave_the_rotation_about_it(held: Held) -> None:
    # On an edge along z, which lies 15 and 10 mm from the centre; by hand the free motion is that about the edge.
    edge = held.corners([0, 1])
    assert len(edge) == 2
    springs, six = held.springs([(n, d, 1e6) for n in edge for d in (X, Y, Z)])
    result = held.body(springs)
    about = np.concatenate([np.cross(Z, CENTRE - CORNER), Z])
    np.testing.assert_allclose(six @ about, 0, atol=1e-6)
    assert result.frequency[0] < 1e-4 * result.frequency[1]
    loose = result.shape[:, 0] / result.shape[5, 0]
    np.testing.assert_allclose(loose, about, atol=1e-6)
    # The centre moves as well, with most of the energy: it is called a rotation all the same.
    assert result.free == ("rotation about z",)
    with pytest.raises(
        RomError, match=r"not held: brick: rotation about z \(about the centre of mass\): give that line contact"
    ):
        check_supported([result])


@pytest.mark.parametrize("axis", range(3))
def test_a_direction_without_springs_is_named(held: Held, axis: int) -> None:
    # Springs square to one axis, at places that hold every rotation.
    others = [d for number, d in enumerate(np.eye(3)) if number != axis]
    springs, _ = held.springs([(n, d, 1e6) for n in range(10) for d in others])
    result = held.body(springs)
    assert result.free == (MOTIONS[axis],)
    with pytest.raises(RomError, match=rf"not held: brick: {MOTIONS[axis]} \(about"):
        check_supported([result])


def test_one_spring_leaves_five_motions_and_none_leaves_six(held: Held) -> None:
    assert len(held.body(held.springs([(0, X, 1e6)])[0]).free) == 5
    assert len(held.body(held.springs([])[0]).free) == 6


def test_each_free_motion_has_a_name_of_its_own(held: Held) -> None:
    for seed in range(100):
        rng = np.random.default_rng(seed)
        nodes = rng.integers(0, 10, int(rng.integers(1, 5)))
        springs, _ = held.springs([(int(n), rng.standard_normal(3), 1e6) for n in nodes])
        free = held.body(springs).free
        assert len(free) >= 6 - len(nodes)
        assert len(set(free)) == len(free)


def test_every_loose_body_is_in_the_message(held: Held) -> None:
    whole = held.body(held.springs([(n, d, 1e6) for n in range(10) for d in (X, Y, Z)])[0])
    loose = held.body(held.springs([(n, d, 1e6) for n in range(10) for d in (X, Z)])[0])
    check_supported([])
    check_supported([whole, whole])
    with pytest.raises(RomError, match=r"^not held: brick: y; brick: y \(about the centre of mass\): give"):
        check_supported([loose, whole, loose])


def test_a_supported_body_is_refused(held: Held) -> None:
    none = np.zeros((held.assembly.n_dof,) * 2)
    with pytest.raises(RomError, match="beam is supported: rigid-body motions are for a body that is held"):
        make_rigid_body(held.assembly, "beam", held.meshes["beam"].points, none)


def test_a_body_that_is_none_is_refused(held: Held) -> None:
    none = np.zeros((held.assembly.n_dof,) * 2)
    with pytest.raises(RomError, match='no body "brik": it has beam, brick'):
        make_rigid_body(held.assembly, "brik", held.brick.points, none)


def test_how_a_body_is_held_cannot_be_written(held: Held) -> None:
    springs, _ = held.springs([(0, X, 1e6)])
    result = make_rigid_body(held.assembly, "brick", held.brick.points, springs)
    for values in (result.centre, result.stiffness, result.frequency, result.shape):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0.0
