"""CalculiX, an independent code, gives the same matrices and frequencies for the bodies that are shipped.

The matrices and frequencies must agree to 1e-5. They do to 1e-10 and 1e-8: what is left are the 13 digits of the deck's
coordinates, the 14 of the matrix files, and for frequencies the condition of the stiffness. The tests ask for that, for
a difference in the integration rule would hide below 1e-5 on cells that are nearly bricks.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.calculix_run import find_ccx, run_frequency, run_matrices
from fe.element import Element
from fe.material import STEEL, Material
from fe.mesh import Mesh
from fe.mesher.blade import PadMesh, mesh_blade
from fe.mesher.mesh_rule import MeshRule
from fe.mesher.plain_blade import mesh_plain_blade
from fe.modal import modes
from geometry.blade import Blade
from geometry.plain_blade import PlainBlade
from tests.slow import slow

pytestmark = [
    pytest.mark.calculix,
    pytest.mark.skipif(find_ccx() is None, reason="CalculiX is not installed: apt-get install calculix-ccx"),
]

BoxMesher = Callable[..., Mesh]
MATRICES, FREQUENCIES = 1e-10, 1e-8
ALUMINIUM = Material(young=70e9, poisson=0.33, density=2700.0)


def distorted_block(element: Element, box: BoxMesher) -> Mesh:
    mesh = box(element, counts=(4, 2, 2), size=(0.2, 0.06, 0.04), distortion=0.2, bow=0.1, seed=3)
    return replace(mesh, face_sets={"clamp": mesh.face_sets["x0"]})


def plain_blade(element: Element, box: BoxMesher) -> Mesh:
    rule = MeshRule(element=element, through_thickness=1, length_ratio=2.36, length_cap=0.01)
    return mesh_plain_blade(PlainBlade(), rule)


def slotted_blade(element: Element, box: BoxMesher) -> Mesh:
    rule = MeshRule(element=element, through_thickness=1, length_ratio=2.4, length_cap=0.02)
    # Fewer cells in the pads than are shipped, of the same curved kind.
    return mesh_blade(Blade(), rule, PadMesh(across_groove=2, across_lip=1, above_groove=2, band=1))


def two_materials(mesh: Mesh) -> tuple[Mesh, dict[str, Material]]:
    """Aluminium for the lower half of the cells, steel for the others."""
    half = {"soft": np.arange(mesh.n_cell // 2), "hard": np.arange(mesh.n_cell // 2, mesh.n_cell)}
    return replace(mesh, cell_sets=half), {"soft": ALUMINIUM, "hard": STEEL}


def difference(ours: sp.csr_array, theirs: sp.csr_array) -> float:
    return float(abs(ours - theirs).max() / abs(theirs).max())


def all_directions(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.column_stack([np.repeat(nodes, 3), np.tile([0, 1, 2], len(nodes))])


@pytest.mark.parametrize("seed", [0, 1])
def test_mass_and_stiffness_of_one_distorted_cell_agree(element: Element, seed: int) -> None:
    stray = np.random.default_rng(seed).uniform(-0.15, 0.15, element.nodes.shape)
    points = (element.nodes + stray) * [0.01, 0.02, 0.005]
    mesh = Mesh(points=points, cells={element.cell_type: np.arange(element.n_node)[None]})
    for ours, theirs in zip(assemble(mesh, STEEL), run_matrices(mesh, STEEL), strict=True):
        assert difference(ours, theirs) < MATRICES


@pytest.mark.parametrize(
    "body", [distorted_block, plain_blade, pytest.param(slotted_blade, marks=slow)], ids=lambda body: body.__name__
)
def test_matrices_and_the_first_ten_frequencies_of_two_materials_agree(
    body: Callable[[Element, BoxMesher], Mesh], element: Element, box: BoxMesher
) -> None:
    mesh, materials = two_materials(body(element, box))
    mass, stiffness = assemble(mesh, materials)
    their_mass, their_stiffness = run_matrices(mesh, materials)
    assert difference(mass, their_mass) < MATRICES
    assert difference(stiffness, their_stiffness) < MATRICES
    clamp = mesh.nodes("clamp")
    ours = modes(supported_system(mesh, mass, stiffness, [Support(nodes=clamp)]), 10).frequency
    np.testing.assert_allclose(ours, run_frequency(mesh, materials, all_directions(clamp), 10), rtol=FREQUENCIES)
