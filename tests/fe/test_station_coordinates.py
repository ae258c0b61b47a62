"""Stations between nodes: exact for linear fields, a change of variables and nothing else."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, make_rigid_motions, supported_system
from fe.element import HEX20, TET10, Element
from fe.errors import MeshError
from fe.face_integral import find_outer_faces
from fe.host_face import find_station_weights
from fe.material import STEEL
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.modal import modes
from fe.sparse.solver import factorise
from fe.station_coordinates import make_station_coordinates
from fe.system import LinearSystem
from tests.slow import slow

BoxMesher = Callable[..., Mesh]
SIZE = (1.0, 0.8, 0.6)
#: Seven places on the top of the box, on a slanting line from rim to rim.
LINE = np.column_stack([np.linspace(0, 1, 7), np.linspace(0.1, 0.65, 7), np.full(7, SIZE[2])])


def test_weights_sum_to_one_and_give_back_the_places(element: Element, box: BoxMesher) -> None:
    mesh = box(element, size=SIZE, distortion=0.2)
    weights = find_station_weights(mesh, "line", mesh.face_sets["z1"], LINE)
    # The last step of Newton leaves round-off; shape functions are of the size of one.
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(weights @ mesh.points, LINE, atol=1e-13)
    assert np.isin(weights.indices, mesh.nodes("z1")).all()


def test_a_linear_displacement_is_exact_at_stations(element: Element, box: BoxMesher) -> None:
    mesh = box(element, size=SIZE, distortion=0.2)
    gradient = np.random.default_rng(2).standard_normal((3, 3))
    weights = find_station_weights(mesh, "line", mesh.face_sets["z1"], LINE)
    np.testing.assert_allclose(weights @ (mesh.points @ gradient.T), LINE @ gradient.T, atol=1e-12)


@pytest.mark.parametrize("element", [HEX20, TET10], ids=lambda element: element.name)
def test_a_quadratic_displacement_is_exact_at_stations_on_straight_cells(element: Element, box: BoxMesher) -> None:
    mesh = box(element, size=SIZE)
    weights = find_station_weights(mesh, "line", mesh.face_sets["z1"], LINE)
    x, y, _ = mesh.points.T
    np.testing.assert_allclose(
        weights @ (x * y - 2 * y**2 + x**2), LINE[:, 0] * LINE[:, 1] - 2 * LINE[:, 1] ** 2 + LINE[:, 0] ** 2, atol=1e-13
    )


def test_a_force_at_a_station_keeps_its_resultant_and_its_moment(element: Element, box: BoxMesher) -> None:
    mesh = box(element, size=SIZE, distortion=0.2)
    weights = find_station_weights(mesh, "line", mesh.face_sets["z1"], LINE)
    forces = np.random.default_rng(3).standard_normal((len(LINE), 3))
    at_nodes = weights.T @ forces
    np.testing.assert_allclose(at_nodes.sum(axis=0), forces.sum(axis=0), atol=1e-13)
    moments = (np.cross(points, given).sum(axis=0) for points, given in ((mesh.points, at_nodes), (LINE, forces)))
    np.testing.assert_allclose(*moments, atol=1e-13)


def test_a_station_beside_a_curved_face_goes_to_its_nearest_point() -> None:
    def shape(
        u: NDArray[np.float64], v: NDArray[np.float64], w: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], ...]:
        return (1 + v) * np.cos(u), (1 + v) * np.sin(u), w

    mesh = mesh_blocks([Block(shape=shape, counts=(4, 1, 1), faces={"v1": "outside"})], TET10)
    angle = np.linspace(0.05, 0.95, 7)
    on_cylinder = np.column_stack([2 * np.cos(angle), 2 * np.sin(angle), np.full(7, 0.4)])
    result = find_station_weights(mesh, "line", mesh.face_sets["outside"], on_cylinder) @ mesh.points
    miss = result - on_cylinder
    # Parabolas over a quarter radian miss a circle of radius 2 by some 1e-5, and along its normal.
    assert 1e-7 < np.abs(miss).max() < 1e-4
    along = np.column_stack([-np.sin(angle), np.cos(angle), 0 * angle])
    np.testing.assert_allclose((miss * along).sum(axis=1), 0, atol=0.02 * np.abs(miss).max())


def supported(element: Element, box: BoxMesher, distortion: float = 0.2) -> tuple[Mesh, sp.csr_array, sp.csr_array]:
    mesh = box(element, counts=(3, 3, 2), size=SIZE, distortion=distortion)
    return mesh, *assemble(mesh, STEEL)


def test_the_change_of_variables_leaves_the_frequencies_as_they_are(element: Element, box: BoxMesher) -> None:
    mesh, mass, stiffness = supported(element, box)
    stations = make_station_coordinates(mesh, {"line": LINE[[1, 3, 5]]}, {"line": "z1"}, fixed=["x0"])
    support = [Support(nodes=mesh.nodes("x0"))]
    before = supported_system(mesh, mass, stiffness, support)
    after = supported_system(mesh, stations.matrix(mass), stations.matrix(stiffness), support)
    result, expected = modes(after, 8), modes(before, 8)
    # The condition number of the stiffness, some 1e4, times round-off, squared by the two products.
    np.testing.assert_allclose(result.frequency, expected.frequency, rtol=1e-9)
    # In the new coordinates the pivots hold what the stations do.
    on_nodes = before.on_mesh(stations.displacement(before, result.mode_shapes))
    weights = find_station_weights(mesh, "line", mesh.face_sets["z1"], LINE[[1, 3, 5]])
    at_stations = np.einsum("sn,nim->sim", weights.toarray(), on_nodes)
    pivots = stations.mesh.node_sets["line"]
    np.testing.assert_allclose(
        after.on_mesh(result.mode_shapes)[pivots], at_stations, atol=1e-9 * np.abs(on_nodes).max()
    )
    np.testing.assert_allclose(
        np.abs(np.einsum("nm,nm->m", on_nodes.reshape(-1, 8)[before.free], before.mass @ expected.mode_shapes)),
        1,
        atol=1e-6,
    )


def test_a_spring_on_a_station_coordinate_is_a_spring_on_its_face(element: Element, box: BoxMesher) -> None:
    mesh, mass, stiffness = supported(element, box)
    places, spring = LINE[[1, 3, 5]], 1e10
    stations = make_station_coordinates(mesh, {"line": places}, {"line": "z1"}, fixed=["x0"])
    support = [Support(nodes=mesh.nodes("x0"))]
    weights = sp.kron(find_station_weights(mesh, "line", mesh.face_sets["z1"], places), sp.eye_array(3))
    on_faces = sp.csr_array(stiffness + spring * weights.T @ weights)
    diagonal = np.zeros(3 * mesh.n_node)
    diagonal[(3 * stations.mesh.node_sets["line"][:, None] + np.arange(3)).ravel()] = spring
    on_coordinates = sp.csr_array(stations.matrix(stiffness) + sp.diags_array(diagonal))
    first = modes(supported_system(mesh, mass, on_faces, support), 6).frequency
    second = modes(supported_system(mesh, stations.matrix(mass), on_coordinates, support), 6).frequency
    np.testing.assert_allclose(second, first, rtol=1e-9)
    # The springs are felt: without them the first frequency is another.
    free = modes(supported_system(mesh, mass, stiffness, support), 6).frequency
    assert first[0] > 1.02 * free[0]


def test_rigid_motions_of_the_stations_are_those_of_the_body(box: BoxMesher) -> None:
    mesh, _, stiffness = supported(TET10, box)
    stations = make_station_coordinates(mesh, {"line": LINE[[1, 3, 5]]}, {"line": "z1"})
    moved = mesh.points.copy()
    moved[stations.mesh.node_sets["line"]] = LINE[[1, 3, 5]]
    centre = mesh.points.mean(axis=0)
    # The station stands where its pivot stood: a rigid motion of these places is one of the body.
    motions = make_rigid_motions(moved, centre).reshape(-1, 6)
    np.testing.assert_allclose(stations.matrix(stiffness) @ motions, 0, atol=1e-11 * abs(stiffness).max())


def slab(element: Element, counts: tuple[int, int, int], low: float, high: float) -> Mesh:
    faces = {"u0": "x0", "v0": "y0", "w0": "below", "w1": "above"}
    box = Block(shape=lambda u, v, w: (0.6 * u, 0.6 * v, low + (high - low) * w), counts=counts, faces=faces)
    return mesh_blocks([box], element)


@pytest.mark.parametrize(
    ("first", "second"),
    [(TET10, TET10), pytest.param(TET10, HEX20, marks=slow), pytest.param(HEX20, TET10, marks=slow)],
    ids=lambda e: e.name,
)
def test_a_constant_stress_crosses_a_tied_interface_whose_meshes_do_not_match(first: Element, second: Element) -> None:
    lower, upper = slab(first, (2, 2, 1), 0.0, 0.4), slab(second, (3, 3, 2), 0.4, 1.0)
    # Stations of a 3-point rule, exact to degree 2, on a grid of triangles that both meshes' lines belong to; the two
    # triangles of a square make it exact to degree 3, which the products of serendipity functions need.
    places, areas = [], []
    for i in range(6):
        for j in range(6):
            for corners in (((i, j), (i + 1, j), (i + 1, j + 1)), ((i, j), (i + 1, j + 1), (i, j + 1))):
                a, b, c = 0.1 * np.array(corners, dtype=float)
                places += [(4 * p + q + r) / 6 for p, q, r in ((a, b, c), (b, c, a), (c, a, b))]
                areas += [0.1**2 / 2 / 3] * 3
    stations = np.column_stack([np.array(places), np.full(len(places), 0.4)])
    sides = (
        find_station_weights(lower, "tie", lower.face_sets["above"], stations),
        find_station_weights(upper, "tie", upper.face_sets["below"], stations),
    )
    relative = sp.kron(sp.hstack([sides[0], -sides[1]]), sp.eye_array(3))
    foundation = 1e12
    springs = sp.diags_array(foundation * np.repeat(areas, 3))
    blocks = [assemble(mesh, STEEL)[1] for mesh in (lower, upper)]
    stiffness = sp.csr_array(sp.block_diag(blocks) + relative.T @ springs @ relative)
    # A uniform pull: sigma / E along z, -nu sigma / E across, and the springs open by sigma / foundation.
    stress = 1e8
    points = np.vstack([lower.points, upper.points])
    strain = stress / STEEL.young
    exact = points * strain * [-STEEL.poisson, -STEEL.poisson, 1]
    exact[lower.n_node :, 2] += stress / foundation
    held = np.zeros((len(points), 3), dtype=bool)
    for start, mesh in ((0, lower), (lower.n_node, upper)):
        held[start + mesh.nodes("x0"), 0] = True
        held[start + mesh.nodes("y0"), 1] = True
    held[lower.nodes("below"), 2] = True
    held[lower.n_node + upper.nodes("above"), 2] = True
    free, fixed = np.flatnonzero(~held.ravel()), np.flatnonzero(held.ravel())
    result = exact.ravel().copy()
    result[free] = factorise(sp.csr_array(stiffness[free][:, free])).solve(-stiffness[free][:, fixed] @ result[fixed])
    np.testing.assert_allclose(result, exact.ravel(), atol=1e-10 * np.abs(exact).max())


def test_pivots_are_neither_held_nor_named_nor_shared(box: BoxMesher) -> None:
    mesh = box(TET10, counts=(3, 3, 2), size=SIZE)
    weights = find_station_weights(mesh, "line", mesh.face_sets["z1"], LINE)
    named = int(weights[[3]].indices[np.abs(weights[[3]].data).argmax()])
    mesh = replace(mesh, node_sets={"sensor": np.array([named])})
    stations = make_station_coordinates(mesh, {"line": LINE[1:]}, {"line": "z1"}, fixed=["x0"])
    pivots = stations.mesh.node_sets["line"]
    assert len(set(pivots.tolist())) == 6
    assert not np.isin(pivots, [named, *mesh.nodes("x0")]).any()
    np.testing.assert_array_equal(stations.mesh.node_sets["sensor"], [named])


def test_a_station_off_the_body_is_refused_with_its_distance(box: BoxMesher) -> None:
    mesh = box(TET10, size=SIZE)
    off = LINE + np.where(np.arange(7)[:, None] == 4, [0, 0, 0.05], 0)
    with pytest.raises(MeshError, match=r'station 5 of "line", at \(.*\) mm, is 50 mm from the nearest face'):
        find_station_weights(mesh, "line", find_outer_faces(mesh), off)
    with pytest.raises(MeshError, match='"line": no face is close enough'):
        find_station_weights(mesh, "line", np.zeros((0, 2), dtype=np.int64), LINE)
    with pytest.raises(MeshError, match='the line "line" lies on the face set "top", but the mesh has x0, x1'):
        make_station_coordinates(mesh, {"line": LINE}, {"line": "top"})


def test_more_stations_in_a_row_than_a_face_can_tell_apart_are_refused(box: BoxMesher) -> None:
    mesh = box(TET10, counts=(1, 1, 1), size=SIZE)
    with pytest.raises(MeshError, match=r"the stations of line are too close.*cells there|no node can be moved"):
        make_station_coordinates(mesh, {"line": LINE}, {"line": "z1"})


def test_a_free_body_keeps_its_six_rigid_motions(box: BoxMesher) -> None:
    mesh, mass, stiffness = supported(TET10, box)
    stations = make_station_coordinates(mesh, {"line": LINE[[1, 3, 5]]}, {"line": "z1"})
    system = LinearSystem(
        mass=stations.matrix(mass),
        damping=0 * mass,
        stiffness=sp.csr_array(stations.matrix(stiffness) + stations.matrix(mass)),
        free=np.arange(3 * mesh.n_node),
        n_node=mesh.n_node,
    )
    result = modes(system, 7).angular_frequency ** 2 - 1
    np.testing.assert_allclose(result[:6], 0, atol=1e-6)
    assert result[6] > 1e3
