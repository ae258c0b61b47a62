r"""Coordinates in which contact stations are degrees of freedom, for a mesh without nodes at the stations.

A station moves with the face that it lies on, :math:`u_s = S q`, with the shape functions of the face in S. The station
replaces one node of its face, the pivot:

.. math:: q_p = S_p^{-1} (u_s - S_r q_r), \qquad q = T \hat q, \qquad \hat K = T^T K T, \quad \hat M = T^T M T .

This is a change of variables, not a constraint: the natural frequencies do not change, and a reduction that keeps
:math:`u_s` keeps the motion of the contact.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from fe.errors import MeshError
from fe.host_face import Places, find_named_faces, find_station_weights
from fe.mesh import Mesh
from fe.sparse.factor import Symmetric
from fe.system import LinearSystem

#: Smallest magnitude of a pivot's weight. On a triangle, the largest of the six shape functions is 1/4 or more in
#: magnitude everywhere.
MIN_PIVOT = 0.05
#: Largest condition number of the pivots' weights: above it several stations share too few nodes.
DEPENDENT = 1e3


@dataclass(frozen=True, kw_only=True, eq=False)
class StationCoordinates:
    """Change of variables on all degrees of freedom of a mesh, 3 * node + direction.

    Parameters
    ----------
    mesh
        The mesh, with a node set of pivots for each line, in the order of its stations.
    to_nodes
        Matrix T from the new coordinates to displacements of the nodes, sparse, shape (3 n_node, 3 n_node) [-].
    """

    mesh: Mesh
    to_nodes: sp.csr_array

    @property
    def places(self) -> Float[NDArray[np.float64], "node 3"]:
        """Positions of the coordinates: nodes, and stations in place of their pivots, shape (n_node, 3) [m]."""
        # Positions transform as displacements do: those of the nodes are T times those of the coordinates.
        result = sp.linalg.spsolve(sp.csc_array(self.to_nodes), self.mesh.points.ravel())
        return np.asarray(result).reshape(-1, 3)

    def matrix(self, of_nodes: Symmetric) -> sp.csr_array:
        """Mass or stiffness matrix in the new coordinates, T^T A T, exactly symmetric."""
        result = sp.csr_array(self.to_nodes.T @ of_nodes.tocsr() @ self.to_nodes)
        return sp.csr_array((result + result.T) / 2)

    def displacement(
        self, system: LinearSystem, vectors: Float[NDArray[np.float64], "n m"]
    ) -> Float[NDArray[np.float64], "n m"]:
        """Displacement of the nodes, on the free degrees of freedom, from vectors in the new coordinates."""
        return np.asarray(self.to_nodes[system.free][:, system.free] @ vectors)

    def vectors(
        self, system: LinearSystem, displacement: Float[NDArray[np.float64], "n m"]
    ) -> Float[NDArray[np.float64], "n m"]:
        """Inverse of `displacement`."""
        to_nodes = sp.csc_array(self.to_nodes[system.free][:, system.free])
        return np.asarray(sp.linalg.splu(to_nodes).solve(np.ascontiguousarray(displacement)))


def make_station_coordinates(
    mesh: Mesh, stations: Mapping[str, Places], faces: Mapping[str, str], fixed: Iterable[str] = ()
) -> StationCoordinates:
    """Make the displacements of stations coordinates.

    Parameters
    ----------
    mesh
        The mesh. Nodes in its node sets are not replaced.
    stations
        Stations by the name of their line, shape (n_station, 3) [m].
    faces
        Face set on which the stations of each line lie, by the name of the line.
    fixed
        Sets of nodes that will be fixed; these nodes are not replaced.

    Raises
    ------
    MeshError
        A station that lies on no face, no node that it can replace, or more stations on a face than its shape functions
        can distinguish.
    """
    taken = {int(node) for name in (*mesh.node_sets, *fixed) for node in mesh.nodes(name)}
    weights = [
        find_station_weights(mesh, name, find_named_faces(mesh, name, faces[name]), places)
        for name, places in stations.items()
    ]
    every = sp.csr_array(sp.vstack(weights))
    labels = [f'station {k + 1} of "{name}"' for name, places in stations.items() for k in range(len(places))]
    pivots = _choose_pivots(every, taken, labels)
    block = every[:, pivots].toarray()
    if np.linalg.cond(block) > DEPENDENT:
        raise MeshError(
            f"the stations of {', '.join(stations)} are too close for the mesh: more than three lie in a row on one "
            "face, so give cells there at most twice as long as the stations are apart"
        )
    ends = np.cumsum([len(places) for places in stations.values()])[:-1]
    sets = dict(zip(stations, np.split(pivots, ends), strict=True))
    return StationCoordinates(
        mesh=replace(mesh, node_sets={**mesh.node_sets, **sets}), to_nodes=_to_nodes(every, pivots, block)
    )


def make_node_coordinates(mesh: Mesh) -> StationCoordinates:
    """Coordinates equal to the displacements of the nodes."""
    return StationCoordinates(mesh=mesh, to_nodes=sp.eye_array(3 * mesh.n_node, format="csr"))


def add_mean_coordinate(
    place: StationCoordinates, name: str, weights: Float[NDArray[np.float64], " node"], fixed: Iterable[str] = ()
) -> StationCoordinates:
    """Make the weighted mean displacement of nodes a coordinate; a force on it is distributed by the same weights.

    Parameters
    ----------
    place
        Coordinates so far.
    name
        Name of the node set of the pivot; a node set of that name is replaced.
    weights
        Weights of the nodes, whose sum is one, shape (n_node,) [-].
    fixed
        Sets of nodes that will be fixed; these nodes are not replaced.

    Raises
    ------
    MeshError
        All nodes with a sufficient weight are fixed or in a node set.
    """
    mesh = place.mesh
    sets = {other: nodes for other, nodes in mesh.node_sets.items() if other != name}
    taken = {int(node) for nodes in sets.values() for node in nodes}
    taken |= {int(node) for one in fixed for node in mesh.nodes(one)}
    # T is the same in all three directions.
    own = sp.csr_array(sp.csr_array(weights[None]) @ place.to_nodes[::3, ::3])
    size = np.abs(own.toarray()[0])
    size[list(taken)] = 0
    pivot = np.array([size.argmax()])
    if size[pivot[0]] < MIN_PIVOT * np.abs(weights).max():
        raise MeshError(f'no node can be moved to "{name}", because the nodes that qualify are fixed or named')
    to_nodes = place.to_nodes @ _to_nodes(own, pivot, own[:, pivot].toarray())
    return StationCoordinates(mesh=replace(mesh, node_sets={**sets, name: pivot}), to_nodes=sp.csr_array(to_nodes))


def _choose_pivots(weights: sp.csr_array, taken: set[int], labels: Sequence[str]) -> Int[NDArray[np.int64], " station"]:
    """One pivot node for each station, all different, with the largest product of weights."""
    nodes = np.setdiff1d(weights.indices, np.array(sorted(taken), dtype=np.int64))
    size = np.abs(weights[:, nodes].toarray())
    if size.shape[1] < size.shape[0]:
        raise MeshError("there are more stations than nodes on their faces: mesh with smaller cells there")
    # Maximising the sum of the logarithms maximises the product of the weights.
    station, column = linear_sum_assignment(-np.log(np.maximum(size, 1e-300)))
    if size[station, column].min() < MIN_PIVOT:
        worst = int(size[station, column].argmin())
        raise MeshError(
            f"no node can be moved to {labels[worst]}, because the nodes around it are fixed, named or used for other "
            "stations: mesh with smaller cells there"
        )
    return np.asarray(nodes[column])


def _to_nodes(
    weights: sp.csr_array, pivots: Int[NDArray[np.int64], " station"], block: Float[NDArray[np.float64], "s s"]
) -> sp.csr_array:
    """Matrix T: the identity except in the rows of the pivots."""
    n_node = weights.shape[1]
    others = np.ones(n_node)
    others[pivots] = 0
    rest = weights @ sp.diags_array(others)
    place = sp.csr_array((np.ones(len(pivots)), (pivots, np.arange(len(pivots)))), shape=(n_node, len(pivots)))
    node = sp.diags_array(others) + place @ (sp.csr_array(np.linalg.inv(block)) @ (place.T - rest))
    return sp.csr_array(sp.kron(node, sp.eye_array(3), format="csr"))
