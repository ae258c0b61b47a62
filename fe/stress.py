"""Strain and stress recovered from displacements, at quadrature points and at nodes."""

from collections.abc import Iterator, Mapping

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.assembly import list_cell_elasticity
from fe.element import Element
from fe.errors import MeshError
from fe.material import Material
from fe.mesh import Mesh
from fe.solid import jacobian

Tensor = Float[NDArray[np.float64], "*where 6"]


def compute_strain(
    mesh: Mesh, displacement: Float[NDArray[np.float64], "node 3"], at: Float[NDArray[np.float64], "point 3"]
) -> Float[NDArray[np.float64], "cell point 6"]:
    """Engineering strain xx, yy, zz, xy, yz, zx of every cell at the given reference points.

    Parameters
    ----------
    mesh
        The mesh.
    displacement
        Displacement of the nodes, shape (n_node, 3) [m].
    at
        Reference points of every cell, shape (n_point, 3) [-].

    Returns
    -------
    Strain, shape (n_cell, n_point, 6) [-]; the cells of all blocks in the order of `mesh.cells`.
    """
    return np.concatenate(
        [_evaluate_strain(element, mesh.points[nodes], displacement[nodes], at) for _, element, nodes in mesh.blocks()]
    )


def compute_stress(
    mesh: Mesh,
    materials: Material | Mapping[str, Material],
    displacement: Float[NDArray[np.float64], "node 3"],
    at: Float[NDArray[np.float64], "point 3"] | None = None,
) -> Float[NDArray[np.float64], "cell point 6"]:
    """Cauchy stress xx, yy, zz, xy, yz, zx of every cell at the given reference points.

    Parameters
    ----------
    mesh, displacement
        As in `compute_strain`.
    materials
        As in `fe.assembly.assemble`.
    at
        Reference points of every cell, shape (n_point, 3) [-]; by default the stress points of each element.

    Returns
    -------
    Stress, shape (n_cell, n_point, 6) [Pa].

    Raises
    ------
    MeshError
        Cells of different shape in one mesh, which have no common reference points; or cells without material.
    """
    kinds = {element.n_corner for _, element, _ in mesh.blocks()}
    if len(kinds) > 1:
        raise MeshError(
            f"the mesh mixes cells of different shape ({', '.join(mesh.cells)}), which have no reference points in "
            "common: ask for the stress at its nodes"
        )
    return np.concatenate(list(_compute_stress_of_blocks(mesh, materials, displacement, at)))


def compute_nodal_stress(
    mesh: Mesh, materials: Material | Mapping[str, Material], displacement: Float[NDArray[np.float64], "node 3"]
) -> Float[NDArray[np.float64], "node 6"]:
    """Stress at the nodes: extrapolated from the stress points of each cell, then averaged over the cells at a node.

    At an interface of two materials, where stress is not continuous, the values of both are averaged.

    Parameters
    ----------
    mesh, materials, displacement
        As in `compute_stress`.

    Returns
    -------
    Stress, shape (n_node, 6) [Pa].
    """
    total, cells_at = np.zeros((mesh.n_node, 6)), np.zeros(mesh.n_node)
    sampled = _compute_stress_of_blocks(mesh, materials, displacement, None)
    for (_, element, nodes), values in zip(mesh.blocks(), sampled, strict=True):
        # The corner shape functions interpolate the values at the stress points, and are evaluated at the nodes.
        at_corners = np.linalg.solve(element.corner_shape(element.stress_points), values)
        at_nodes = np.einsum("ac,ecs->eas", element.corner_shape(element.nodes), at_corners)
        np.add.at(total, nodes, at_nodes)
        np.add.at(cells_at, nodes, 1)
    return np.asarray(total / np.maximum(cells_at, 1)[:, None])


def _evaluate_strain(
    element: Element,
    points: Float[NDArray[np.float64], "cell node 3"],
    displacement: Float[NDArray[np.float64], "cell node 3"],
    at: Float[NDArray[np.float64], "point 3"],
) -> Float[NDArray[np.float64], "cell point 6"]:
    _, gradient = jacobian(element, points, at)
    g = np.einsum("eqaj,eai->eqij", gradient, displacement, optimize=True)
    shear = [g[..., i, j] + g[..., j, i] for i, j in ((0, 1), (1, 2), (2, 0))]
    return np.stack([g[..., 0, 0], g[..., 1, 1], g[..., 2, 2], *shear], axis=-1)


def _compute_stress_of_blocks(
    mesh: Mesh,
    materials: Material | Mapping[str, Material],
    displacement: Float[NDArray[np.float64], "node 3"],
    at: Float[NDArray[np.float64], "point 3"] | None,
) -> Iterator[Float[NDArray[np.float64], "cell point 6"]]:
    """Stress of the cells, type by type."""
    elasticity = list_cell_elasticity(mesh, materials)
    for start, element, nodes in mesh.blocks():
        lame, shear, _ = elasticity[:, start : start + len(nodes), None, None]
        e = _evaluate_strain(
            element, mesh.points[nodes], displacement[nodes], element.stress_points if at is None else at
        )
        volumetric = e[..., :3].sum(axis=-1, keepdims=True)
        yield np.concatenate([lame * volumetric + 2 * shear * e[..., :3], shear * e[..., 3:]], axis=-1)


def compute_von_mises(tensor: Tensor) -> Float[NDArray[np.float64], "*where"]:
    """Von Mises stress of a stress tensor xx, yy, zz, xy, yz, zx [Pa]."""
    xx, yy, zz, xy, yz, zx = np.moveaxis(tensor, -1, 0)
    deviatoric = ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2
    return np.asarray(np.sqrt(deviatoric + 3 * (xy**2 + yz**2 + zx**2)))
