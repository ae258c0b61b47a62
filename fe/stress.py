"""Strain and stress recovered from displacements, at quadrature points and at nodes."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.assembly import cell_elasticity
from fe.element import ELEMENTS, HEX8
from fe.material import Material
from fe.mesh import Mesh
from fe.quadrature import gauss_hexahedron
from fe.solid import jacobian

#: Points where the stress of a hexahedron is taken before it goes to the nodes: the 2 x 2 x 2 Gauss points, at which
#: quadratic elements are one order more accurate than elsewhere (Barlow, Int. J. Num. Meth. Eng. 10, 1976, 243-251).
SAMPLING = gauss_hexahedron(2)[0]

Tensor = Float[NDArray[np.float64], "*where 6"]


def strain(
    mesh: Mesh, displacement: Float[NDArray[np.float64], "node 3"], at: Float[NDArray[np.float64], "point 3"]
) -> Float[NDArray[np.float64], "cell point 6"]:
    """Engineering strain xx, yy, zz, xy, yz, zx of every cell at the given reference points.

    Parameters
    ----------
    mesh
        The mesh.
    displacement
        At the nodes, shape (n_node, 3) [m].
    at
        Reference points, shape (n_point, 3) [-].

    Returns
    -------
    Shape (n_cell, n_point, 6) [-], cells through the blocks in the order of `mesh.cells`.
    """
    parts = []
    for cell_type, nodes in mesh.cells.items():
        _, gradient = jacobian(ELEMENTS[cell_type], mesh.points[nodes], at)
        g = np.einsum("eqaj,eai->eqij", gradient, displacement[nodes], optimize=True)
        shear = [g[..., i, j] + g[..., j, i] for i, j in ((0, 1), (1, 2), (2, 0))]
        parts.append(np.stack([g[..., 0, 0], g[..., 1, 1], g[..., 2, 2], *shear], axis=-1))
    return np.concatenate(parts)


def stress(
    mesh: Mesh,
    materials: Material | Mapping[str, Material],
    displacement: Float[NDArray[np.float64], "node 3"],
    at: Float[NDArray[np.float64], "point 3"] = SAMPLING,
) -> Float[NDArray[np.float64], "cell point 6"]:
    """Cauchy stress xx, yy, zz, xy, yz, zx of every cell at the given reference points.

    Parameters
    ----------
    mesh, displacement
        As in `strain`.
    materials
        As in `fe.assembly.assemble`.
    at
        Reference points, shape (n_point, 3) [-]; by default the 2 x 2 x 2 Gauss points.

    Returns
    -------
    Shape (n_cell, n_point, 6) [Pa].
    """
    lame, shear, _ = cell_elasticity(mesh, materials)[:, :, None, None]
    e = strain(mesh, displacement, at)
    volumetric = e[..., :3].sum(axis=-1, keepdims=True)
    normal = lame * volumetric + 2 * shear * e[..., :3]
    return np.concatenate([normal, shear * e[..., 3:]], axis=-1)


def nodal_stress(
    mesh: Mesh, materials: Material | Mapping[str, Material], displacement: Float[NDArray[np.float64], "node 3"]
) -> Float[NDArray[np.float64], "node 6"]:
    """Stress at the nodes: extrapolated from the Gauss points of each cell, then averaged over the cells at a node.

    At an interface of two materials the average mixes them: stress is not continuous there.

    Parameters
    ----------
    mesh, materials, displacement
        As in `stress`.

    Returns
    -------
    Shape (n_node, 6) [Pa].
    """
    sampled = stress(mesh, materials, displacement)
    total, cells_at = np.zeros((mesh.n_node, 6)), np.zeros(mesh.n_node)
    start = 0
    for cell_type, nodes in mesh.cells.items():
        # The trilinear field through the eight Gauss points, read at the nodes.
        reach = HEX8.shape(ELEMENTS[cell_type].nodes * np.sqrt(3.0))
        order = [int(np.abs(HEX8.nodes - np.sign(point)).sum(axis=1).argmin()) for point in SAMPLING]
        at_nodes = np.einsum("aq,eqs->eas", reach[:, order], sampled[start : start + len(nodes)])
        np.add.at(total, nodes, at_nodes)
        np.add.at(cells_at, nodes, 1)
        start += len(nodes)
    return np.asarray(total / np.maximum(cells_at, 1)[:, None])


def von_mises(tensor: Tensor) -> Float[NDArray[np.float64], "*where"]:
    """Von Mises stress of a stress tensor xx, yy, zz, xy, yz, zx [Pa]."""
    xx, yy, zz, xy, yz, zx = np.moveaxis(tensor, -1, 0)
    deviatoric = ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2
    return np.asarray(np.sqrt(deviatoric + 3 * (xy**2 + yz**2 + zx**2)))
