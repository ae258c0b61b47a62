"""Measure the quality of the cells of a mesh, and refuse inverted cells."""

from dataclasses import dataclass
from os import PathLike

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import Element
from fe.errors import InvertedCell
from fe.mesh import Mesh

PerCell = Float[NDArray[np.float64], " cell"]

#: Number of cells per chunk: 47 points x 9 entries x 8 bytes per hex20 limit a chunk to about 70 MB for any mesh.
CHUNK = 20_000
#: Smallest det J relative to its mean: zero, with a margin for the round-off of a collapsed corner.
COLLAPSED = 1e-9
#: Largest number of cells that an error message lists.
LISTED = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Quality:
    """Shape of each cell, in the mesh's cell order.

    Parameters
    ----------
    scaled_jacobian
        Smallest triple product of the three *unit* edge vectors at a corner, divided by that of the regular cell, in
        [-1, 1]: 1 for a brick or a regular tetrahedron, below 0.2 for a poor cell, 0 or less for a folded cell, shape
        (n_cell,) [-]. It depends on corner nodes only.
    determinant_ratio
        Smallest determinant of the isoparametric map over the quadrature points and all nodes, divided by the
        magnitude of its mean over the cell, at most 1, shape (n_cell,) [-]. It depends also on midside nodes.
    volume
        Integral of the determinant by the quadrature rule of the element, negative for an inverted cell, shape
        (n_cell,) [m^3].
    """

    scaled_jacobian: PerCell
    determinant_ratio: PerCell
    volume: PerCell


def measure_cell_quality(mesh: Mesh) -> Quality:
    r"""Scaled Jacobian, determinant ratio and volume of every cell.

    .. math:: J_{ij} = \sum_a x_{a,i} \frac{\partial N_a}{\partial \xi_j}, \qquad
        q = \frac{\min \det J}{|\bar{\det J}|}, \qquad
        s = \min_c \hat e_{c,1} \cdot (\hat e_{c,2} \times \hat e_{c,3})

    References
    ----------
    Knupp, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23 (2001): the scaled Jacobian.
    """
    scaled, ratio, volume = [np.empty(0)], [np.empty(0)], [np.empty(0)]
    for _, element, cells in mesh.blocks():
        for start in range(0, len(cells), CHUNK):
            corners = mesh.points[cells[start : start + CHUNK]]
            scaled.append(_compute_scaled_jacobian(element, corners))
            smallest, mean = _compute_determinant(element, corners)
            # The ratio is 0, for a collapsed cell, if the mean is zero.
            ratio.append(np.divide(smallest, abs(mean), out=np.zeros_like(mean), where=mean != 0))
            volume.append(mean * element.rule[1].sum())
    return Quality(
        scaled_jacobian=np.concatenate(scaled),
        determinant_ratio=np.concatenate(ratio),
        volume=np.concatenate(volume),
    )


def check_quality(
    mesh: Mesh, *, source: str | PathLike[str] | None = None, labels: Int[NDArray[np.int64], " cell"] | None = None
) -> Quality:
    """Refuse a mesh with a cell that is inverted, folded or collapsed anywhere.

    Parameters
    ----------
    mesh
        The mesh.
    source
        File of the mesh, for the message.
    labels
        Labels of the cells in the file, shape (n_cell,) [-]; by default cells are counted from 0.

    Returns
    -------
    Quality of all cells.

    Raises
    ------
    InvertedCell
        At least one determinant is not positive; the message names file, cell type, cell sets, numbers and remedy.
    """
    quality = measure_cell_quality(mesh)
    bad = np.flatnonzero(~(quality.determinant_ratio > COLLAPSED))
    if not bad.size:
        return quality
    numbers = bad if labels is None else np.asarray(labels)[bad]
    listed = ", ".join(str(number) for number in numbers[:LISTED]) + (", ..." if bad.size > LISTED else "")
    word = "cell" if bad.size == 1 else "cells"
    raise InvertedCell(
        f"{_name_place(mesh, bad, source)}: {bad.size} of {mesh.n_cell} cells inverted or collapsed ({word} {listed}; "
        f"smallest det J {quality.determinant_ratio[bad].min():.3g} of its mean): {_suggest_remedy(mesh, quality, bad)}"
    )


def _name_place(mesh: Mesh, bad: Int[NDArray[np.int64], " k"], source: str | PathLike[str] | None) -> str:
    """File, types and cell sets of the bad cells, as the beginning of a sentence."""
    ends = np.cumsum([len(cells) for cells in mesh.cells.values()])
    blocks = np.unique(np.searchsorted(ends, bad, side="right"))
    types = " and ".join(list(mesh.cells)[block] for block in blocks)
    sets = [f'"{name}"' for name, cells in mesh.cell_sets.items() if np.isin(bad, cells).any()]
    of_set = f" of cell set {', '.join(sets)}" if sets else ""
    head = f"mesh file {source}" if source is not None else "mesh"
    return f"{head}, {types} cells{of_set}"


def _suggest_remedy(mesh: Mesh, quality: Quality, bad: Int[NDArray[np.int64], " k"]) -> str:
    if bad.size == mesh.n_cell and (quality.volume < 0).all():
        return "all are mirrored, so reverse their node order (a part mirrored with negative scale does this)"
    if (quality.scaled_jacobian[bad] > 0).all():
        return "their corners are sound, so move the midside nodes back towards the middle of their edges"
    return "remesh that region with smaller or less skewed cells"


def _compute_determinant(element: Element, nodes: Float[NDArray[np.float64], "cell node 3"]) -> tuple[PerCell, PerCell]:
    """Smallest determinant over quadrature points and nodes, and its mean over the cell by the quadrature rule."""
    points, weights = element.rule
    gradient = element.gradient(np.vstack([points, element.nodes]))
    determinant = np.linalg.det(np.einsum("cai,paj->cpij", nodes, gradient, optimize=True))
    return determinant.min(axis=1), determinant[:, : len(points)] @ weights / weights.sum()


def _compute_scaled_jacobian(element: Element, nodes: Float[NDArray[np.float64], "cell node 3"]) -> PerCell:
    corners = nodes[:, : element.n_corner]
    edges = corners[:, _find_corner_neighbours(element)] - corners[:, :, None]
    length = np.linalg.norm(edges, axis=3, keepdims=True)
    unit = np.divide(edges, length, out=np.zeros_like(edges), where=length > 0)
    # If a corner is sharper than that of the regular cell, another one is blunter.
    smallest: PerCell = np.linalg.det(unit).min(axis=1) / element.regular_corner
    return smallest


def _find_corner_neighbours(element: Element) -> Int[NDArray[np.int64], "corner 3"]:
    """Three neighbours of each corner along edges, ordered so that the triple product of a valid cell is positive."""
    corners = element.nodes[: element.n_corner]
    result = []
    for corner in range(element.n_corner):
        edges = {
            frozenset((face[k], face[(k + 1) % len(face)])) for face in element.corner_faces for k in range(len(face))
        }
        ends = sorted(next(iter(edge - {corner})) for edge in edges if corner in edge)
        if np.linalg.det(corners[ends] - corners[corner]) < 0:
            ends = [ends[1], ends[0], ends[2]]
        result.append(ends)
    return np.array(result)
