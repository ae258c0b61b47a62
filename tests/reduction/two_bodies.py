"""A beam and a block on its end that touch along a line, in full: for tests of what is reduced and joined."""

import numpy as np
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
from geometry.interface import ContactLine, straight_contact_line
from reduction.line_contact import make_contact_directions

STEEL = Material(young=210e9, poisson=0.3, density=7800)
#: Beam below, block above it on its end, along which they touch: three stations at x = 60, 65, 70 mm, z = 10 mm.
BEAM, BLOCK = ((0.0, 0.0, 0.0), (0.07, 0.01, 0.01)), ((0.06, 0.0, 0.01), (0.07, 0.01, 0.02))


def box(low: tuple[float, float, float], high: tuple[float, float, float], counts: tuple[int, int, int]) -> Mesh:
    def shape(u: Lattice, v: Lattice, w: Lattice) -> tuple[Lattice, Lattice, Lattice]:
        x, y, z = (a + (b - a) * s for a, b, s in zip(low, high, (u, v, w), strict=True))
        return x, y, z

    return mesh_blocks([Block(shape=shape, counts=counts, faces={"u0": "left"})], HEX20)


def nearest(mesh: Mesh, points: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.array([int(np.argmin(np.linalg.norm(mesh.points - point, axis=1))) for point in points])


def line_on_block() -> ContactLine:
    """On the block: its normal points down into the beam."""
    return straight_contact_line(
        name="contact",
        start=np.array([0.06, 0.005, 0.01]),
        end=np.array([0.07, 0.005, 0.01]),
        normal=np.array([0.0, 0.0, -1.0]),
        across=np.array([0.0, 1.0, 0.0]),
        n_station=3,
    )


class Whole:
    """Both bodies in full, side by side."""

    def __init__(self, line: ContactLine) -> None:
        self.meshes = {"beam": box(*BEAM, (14, 2, 2)), "block": box(*BLOCK, (2, 2, 2))}
        self.systems: dict[str, LinearSystem] = {}
        self.boundary: dict[str, dict[str, NDArray[np.int64]]] = {}
        for body, mesh in self.meshes.items():
            mass, stiffness = assemble(mesh, STEEL)
            if body == "beam":
                system = supported_system(mesh, mass, stiffness, [Support(nodes=mesh.nodes("left"))])
            else:
                everything = np.arange(3 * mesh.n_node)
                system = LinearSystem(
                    mass=mass, damping=0 * mass, stiffness=stiffness, free=everything, n_node=mesh.n_node
                )
            self.systems[body] = system
            self.boundary[body] = {"contact": system.rows(nearest(mesh, line.stations))}
        # What lies on one straight line leaves a rotation about it: a third node holds the block while it is reduced.
        top = nearest(self.meshes["block"], np.array([[0.06, 0.0, 0.02]]))
        self.boundary["block"]["top"] = self.systems["block"].rows(top)
        n = self.systems["beam"].n_dof
        self.n_dof = n + self.systems["block"].n_dof
        rows = self.boundary["block"]["contact"].reshape(-1, 3) + n, self.boundary["beam"]["contact"].reshape(-1, 3)
        self.directions = make_contact_directions(self.n_dof, line, *rows)

    def frequencies(self, springs: NDArray[np.float64], n_mode: int) -> NDArray[np.float64]:
        """Dense eigenvalues of all [Hz]."""
        mass = sp.block_diag([system.mass for system in self.systems.values()]).toarray()
        stiffness = sp.block_diag([system.stiffness for system in self.systems.values()]).toarray() + springs
        lambda_ = scipy.linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=[0, n_mode - 1])
        return np.asarray(np.sqrt(lambda_.clip(min=0)) / (2 * np.pi))
