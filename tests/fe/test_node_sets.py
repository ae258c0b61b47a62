"""Names for nodes by where they are: always a corner node, always the nearest, in the order that was asked."""

from collections.abc import Callable

import numpy as np
import pytest

from fe.element import HEX8, HEX20, Element
from fe.errors import MeshError
from fe.mesh import Mesh
from fe.node_sets import add_named_points, add_stations

BoxMesher = Callable[..., Mesh]
BOTH = pytest.mark.parametrize("element", [HEX8, HEX20], ids=lambda element: element.name)


@BOTH
def test_a_named_point_is_the_nearest_corner_node(box: BoxMesher, element: Element) -> None:
    mesh = box(element, counts=(3, 2, 2), distortion=0.2)
    places = np.random.default_rng(0).uniform(-0.2, 1.2, (20, 3))
    named = add_named_points(mesh, {f"p{number}": place for number, place in enumerate(places)})
    corners = mesh.corner_nodes()
    for number, place in enumerate(places):
        by_hand = corners[np.linalg.norm(mesh.points[corners] - place, axis=1).argmin()]
        np.testing.assert_array_equal(named.node_sets[f"p{number}"], [by_hand])


def test_a_midside_node_is_passed_over_even_where_it_is_hit(box: BoxMesher) -> None:
    mesh = box(HEX20, counts=(1, 1, 1))
    on_edge = np.array([0.4, 0.0, 0.0])  # a little nearer to the corner at x = 0 than to that at x = 1
    assert np.linalg.norm(mesh.points - [0.5, 0.0, 0.0], axis=1).min() == 0
    (result,) = add_named_points(mesh, {"p": on_edge}).node_sets["p"]
    np.testing.assert_array_equal(mesh.points[result], [0.0, 0.0, 0.0])


@BOTH
def test_stations_keep_their_order_and_other_sets_stay(box: BoxMesher, element: Element) -> None:
    mesh = box(element, counts=(6, 2, 2), size=(0.6, 0.2, 0.2))
    mesh = add_named_points(mesh, {"response": np.zeros(3)})
    line = np.array([[x, 0.1, 0.2] for x in (0.5, 0.1, 0.3)])
    named = add_stations(mesh, {"line": line})
    # Corner nodes lie where the mesher put them, but for the last bits.
    np.testing.assert_allclose(named.points[named.node_sets["line"]], line, rtol=0, atol=1e-15)
    assert set(named.node_sets) == {"response", "line"}
    assert set(named.face_sets) == set(mesh.face_sets)


def test_stations_off_the_corner_nodes_are_refused_with_number_name_and_distance(box: BoxMesher) -> None:
    mesh = box(HEX20, counts=(2, 1, 1))
    line = np.array([[0.0, 0.0, 0.0], [0.25, 0.0, 0.0], [0.5, 0.0, 0.0]])  # the second is a midside node
    with pytest.raises(MeshError, match=r'station 2 of "line" is 2\.5e\+05 um from the nearest corner node: give'):
        add_stations(mesh, {"line": line})
