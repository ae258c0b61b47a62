"""Stiffness and mass of cells as whole matrices; the product assembles their blocks and never makes them."""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.element import Element
from fe.solid import DIRECTIONS, CellPoints, PerCell, compute_element_blocks


def element_matrices(
    element: Element, points: CellPoints, lame: PerCell, shear: PerCell, density: PerCell
) -> tuple[Float[NDArray[np.float64], "cell dof dof"], Float[NDArray[np.float64], "cell node node"]]:
    """Stiffness and mass as whole matrices of each cell; arguments and errors as in `compute_element_blocks`.

    Returns
    -------
    Stiffness, shape (n_cell, 3 n_node, 3 n_node), degree of freedom 3 a + i [N/m]; mass of one direction, shape
    (n_cell, n_node, n_node) [kg]. Both exactly symmetric.
    """
    blocks, mass = compute_element_blocks(element, points, lame, shear, density)
    n_cell, n_node = mass.shape[:2]
    whole = np.empty((n_cell, n_node, 3, n_node, 3))
    for block, (i, j) in zip(blocks, DIRECTIONS, strict=True):
        whole[:, :, i, :, j] = block
        whole[:, :, j, :, i] = block.swapaxes(1, 2)
    stiffness = whole.reshape(n_cell, 3 * n_node, 3 * n_node)
    # Round-off alone separates the triangles.
    return (stiffness + stiffness.swapaxes(1, 2)) / 2, (mass + mass.swapaxes(1, 2)) / 2
