r"""How fast frequencies converge to those of a box with sliding walls, where the closed form is known.

The walls hold the normal displacement and let the rest slide. Then

.. math:: u = (a_1 \sin k_1 x \cos k_2 y \cos k_3 z,\; a_2 \cos k_1 x \sin k_2 y \cos k_3 z,\;
              a_3 \cos k_1 x \cos k_2 y \sin k_3 z), \qquad k_i = n_i \pi / L_i

has no normal displacement and no shear stress on any wall, and Navier's equation asks
:math:`\rho \omega^2 a = \mu |k|^2 a + (\lambda + \mu)\, k\, (k \cdot a)`: either a is parallel to k and
:math:`\omega = c_p |k|`, or square to it and :math:`\omega = c_s |k|`. An amplitude whose n_i is zero does not exist.
"""

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20, Element
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.modal import modes

BoxMesher = Callable[..., Mesh]
SIZE = (1.0, 0.8, 0.6)


def closed_form(size: tuple[float, float, float], n_mode: int) -> NDArray[np.float64]:
    pressure = np.sqrt((STEEL.lame + 2 * STEEL.shear) / STEEL.density)
    shear = np.sqrt(STEEL.shear / STEEL.density)
    result: list[float] = []
    for n in product(range(8), repeat=3):
        if any(n):
            k = float(np.pi * np.linalg.norm(np.array(n) / size))
            # As many polarisations as there are amplitudes: one along k, the rest square to it.
            result += [pressure * k] + [shear * k] * (np.count_nonzero(n) - 1)
    return np.sort(result)[:n_mode]


def eigenvalue_errors(mesh: Mesh, n_mode: int) -> NDArray[np.float64]:
    """Relative errors of omega^2, the quantity that converges as h^(2p)."""
    walls = [Support(nodes=mesh.nodes(wall), directions=("xyz".index(wall[0]),)) for wall in mesh.face_sets]
    result = modes(supported_system(mesh, *assemble(mesh, STEEL), walls), n_mode).angular_frequency
    return np.asarray(result**2 / closed_form(tuple(mesh.points.max(axis=0)), n_mode) ** 2 - 1)


def test_eigenvalues_converge_from_above_with_order_2p_on_nested_bricks(element: Element, box: BoxMesher) -> None:
    # Tetrahedra reach the limit later: 3.67 from 4 to 8, 3.81 from 6 to 12, 3.85 from 8 to 12.
    near = 0.12 if element.n_corner == 8 else 0.4
    coarse, fine = (eigenvalue_errors(box(element, counts=(n, n, n), size=SIZE), 6) for n in (4, 8))
    assert (fine > 0).all()  # Rayleigh quotients in a subspace; the short rule of tetrahedra changes no sign here
    # Still a little above the limit at these sizes: 1.7 to 2.1 and 3.97 to 4.1 were measured, 2.0 and 4.0 beyond.
    order = np.log2(coarse.sum() / fine.sum())
    assert order == pytest.approx(2 * element.degree, abs=near)


def test_the_order_is_kept_on_bricks_of_unequal_size(element: Element) -> None:
    def errors(n: int) -> NDArray[np.float64]:
        # Two sizes, in the ratio 1 : 3, meet in the middle of each side: affine cells, nested by halving.
        def graded(u: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.interp(u, [0, 0.5, 1], [0, 0.25, 1])

        walls = {"u0": "x0", "u1": "x1", "v0": "y0", "v1": "y1", "w0": "z0", "w1": "z1"}
        block = Block(
            shape=lambda u, v, w: (SIZE[0] * graded(u), SIZE[1] * graded(v), SIZE[2] * graded(w)),
            counts=(n, n, n),
            faces=walls,
        )
        return eigenvalue_errors(mesh_blocks([block], element), 3)

    # Half of the cells are as coarse as those of six a side: the limit is reached a little later (3.63 for tet10).
    near = 0.3 if element.n_corner == 8 else 0.45
    assert np.log2(errors(4).sum() / errors(8).sum()) == pytest.approx(2 * element.degree, abs=near)


def test_quadratic_bricks_lose_their_order_on_trapezoids_of_constant_shape() -> None:
    size = (1.0, 0.1, 0.6)  # flat, so that the first modes do not depend on y and one cell along it will do

    def errors(n: int) -> NDArray[np.float64]:
        def zigzag(u: NDArray[np.float64], w: NDArray[np.float64]) -> NDArray[np.float64]:
            # Every second row of nodes goes up and down by 0.4 of a cell: the shape does not improve with n.
            up_and_down, odd_row = 2 * np.abs(u * n % 2 - 1) - 1, 1 - np.abs(w * n % 2 - 1)
            return w + 0.4 / n * up_and_down * odd_row

        walls = {"u0": "x0", "u1": "x1", "v0": "y0", "v1": "y1", "w0": "z0", "w1": "z1"}
        block = Block(
            shape=lambda u, v, w: (size[0] * u, size[1] * v, size[2] * zigzag(u, w)), counts=(n, 1, n), faces=walls
        )
        return eigenvalue_errors(mesh_blocks([block], HEX20), 2)

    coarse, middle, fine = errors(8), errors(16), errors(32)
    # The second mode is shear in the plane of the trapezoids: 3.4, then 2.8, on the way to 2 (docs/elements.md).
    assert np.log2(coarse / middle)[1] < 3.6
    assert np.log2(middle / fine)[1] < 3.0
    # The first mode varies along x alone, where the cells are as straight as ever.
    assert np.log2(middle / fine)[0] > 3.9
