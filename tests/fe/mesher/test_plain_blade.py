"""The plain blade as cells, and the rule that says how many."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fe.element import HEX8, HEX20, Element
from fe.errors import MeshError, SupportError
from fe.mesh import Mesh
from fe.mesh_quality import measure_cell_quality
from fe.mesher.block import Block, mesh_blocks
from fe.mesher.mesh_rule import MeshRule, count_elements
from fe.mesher.plain_blade import mesh_plain_blade
from fe.node_sets import add_named_points, add_stations, thin_nodes
from geometry.plain_blade import PlainBlade


def rule(element: Element = HEX20, n: int = 1, ratio: float = 2.36, cap: float = 0.005) -> MeshRule:
    return MeshRule(element=element, through_thickness=n, length_ratio=ratio, length_cap=cap)


def volume(blade: PlainBlade) -> float:
    return blade.length * blade.chord * blade.thickness + blade.root_chord * blade.root_thickness * blade.root_height


@settings(max_examples=15, deadline=None)
@given(
    step=st.tuples(*[st.sampled_from([0.0, 1e-3, 7.3e-3])] * 2),
    length=st.floats(0.05, 0.3),
    thickness=st.floats(0.002, 0.02),
    n=st.integers(1, 4),
    ratio=st.floats(1, 10),
    element=st.sampled_from([HEX8, HEX20]),
)
def test_every_plain_blade_has_its_exact_volume_in_bricks(
    step: tuple[float, float], length: float, thickness: float, n: int, ratio: float, element: Element
) -> None:
    blade = PlainBlade(
        length=length,
        thickness=thickness,
        root_thickness=thickness + step[0],
        root_chord=0.024 + step[1],
        excitation_height=0.02,
    )
    mesh = mesh_plain_blade(blade, rule(element, n, ratio, 0.05))
    quality = measure_cell_quality(mesh)
    # Bricks: sums of some thousand exact products.
    assert quality.volume.sum() == pytest.approx(volume(blade), rel=1e-12)
    np.testing.assert_allclose(quality.scaled_jacobian, 1, atol=1e-9)
    clamp = mesh.points[mesh.nodes("clamp")]
    np.testing.assert_allclose(np.abs(clamp[:, 1]), blade.root_thickness / 2, rtol=1e-12)
    assert (clamp[:, 1] > 0).sum() == (clamp[:, 1] < 0).sum() == len(clamp) / 2
    assert clamp[:, 2].max() < 1e-12
    assert clamp[:, 2].min() == pytest.approx(-blade.root_height)
    np.testing.assert_allclose(mesh.points[mesh.nodes("tip"), 2], length, rtol=1e-12)


def test_through_the_thickness_there_are_as_many_elements_as_asked() -> None:
    for n in (1, 2, 5):
        mesh = mesh_plain_blade(PlainBlade(), rule(HEX8, n))
        tip = mesh.points[mesh.nodes("tip")]
        assert len(np.unique(np.round(tip[:, 1], 12))) == n + 1


def test_layers_beside_the_thickness_are_as_thick_as_those_in_it() -> None:
    for n in (1, 2, 5):
        mesh = mesh_plain_blade(PlainBlade(), rule(HEX8, n))
        root = mesh.points[mesh.nodes("root_bottom")]
        # The block is 12 mm thick and the blade 6 mm: twice as many, half of them in the blade's section.
        assert len(np.unique(np.round(root[:, 1], 12))) == n + 2 * -(-n // 2) + 1


def test_element_lengths_follow_the_rule() -> None:
    blade = PlainBlade()
    for n, expected in ((1, 0.005), (3, 2.36 * blade.thickness / 3)):
        mesh = mesh_plain_blade(blade, rule(HEX8, n))
        z = np.unique(np.round(mesh.points[mesh.points[:, 2] > -1e-9, 2], 12))
        step = np.diff(z)
        assert step.max() <= expected * (1 + 1e-9)
        assert step.max() > expected * (1 - 1.5 / len(z))  # not a whole element more than needed


def test_the_named_points_are_the_nearest_corner_nodes() -> None:
    blade = PlainBlade()
    mesh = mesh_plain_blade(blade, rule(HEX20, 1))
    (response,) = mesh.points[mesh.node_sets["response"]]
    assert response[2] == pytest.approx(blade.length)
    assert response[1] == pytest.approx(blade.thickness / 2)
    for name in ("excitation", "response"):
        assert np.isin(mesh.node_sets[name], mesh.corner_nodes()).all()


@given(whole=st.integers(1, 1000), size=st.floats(1e-6, 10))
def test_a_whole_number_of_elements_gains_none_by_round_off(whole: int, size: float) -> None:
    assert count_elements(whole * size, size) == whole


@given(length=st.floats(1e-6, 1), size=st.floats(1e-4, 10))
def test_elements_are_never_longer_than_asked_nor_one_too_many(length: float, size: float) -> None:
    n = count_elements(length, size)
    assert n >= 1
    assert length / n <= size * (1 + 1e-8)
    assert n == 1 or length / (n - 1) > size * (1 - 1e-8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"through_thickness": 0}, "elements_through_thickness = 0: give at least 1"),
        ({"subdivisions": 0}, "subdivisions = 0: give at least 1"),
        ({"length_ratio": 0.0}, "length_ratio = 0 must be positive"),
        ({"length_ratio": float("nan")}, "length_ratio = nan must be positive"),
        ({"length_cap": -0.005}, "length_cap = -5 mm must be positive"),
        ({"length_cap": float("inf")}, "length_cap = inf mm must be positive"),
    ],
    ids=str,
)
def test_a_rule_that_gives_no_mesh_is_refused(change: dict[str, float], message: str) -> None:
    sound = {"element": HEX8, "through_thickness": 1, "length_ratio": 2.4, "length_cap": 0.008}
    with pytest.raises(MeshError, match=message):
        MeshRule(**(sound | change))


def cube(**change: object) -> Block:
    sound = {"shape": lambda u, v, w: (u, v, w), "counts": (2, 1, 1), "faces": {"w0": "low", "w1": "high"}}
    return Block(**(sound | change))


def test_a_left_handed_map_gives_sound_cells_and_the_same_names(element: Element) -> None:
    mesh = mesh_blocks([cube(shape=lambda u, v, w: (u, v, -w))], element)
    np.testing.assert_allclose(measure_cell_quality(mesh).volume, 1 / mesh.n_cell)
    np.testing.assert_allclose(mesh.points[mesh.nodes("low"), 2], 0)
    np.testing.assert_allclose(mesh.points[mesh.nodes("high"), 2], -1)


def test_blocks_join_where_they_touch(element: Element) -> None:
    one = mesh_blocks([cube(counts=(4, 1, 1), shape=lambda u, v, w: (2 * u, v, w))], element)
    two = mesh_blocks([cube(), cube(shape=lambda u, v, w: (1 + u, v, w))], element)
    assert (one.n_node, one.n_cell) == (two.n_node, two.n_cell)
    # Tetrahedra cut each of the four squares into two triangles.
    assert len(two.face_sets["low"]) == (4 if element.n_corner == 8 else 8)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"counts": (2, 0, 1)}, r"a block has \(2, 0, 1\) cells along its sides: give at least one"),
        ({"shape": lambda u, v, w: (u, v, 0 * w)}, "a cell collapses: two of its nodes are closer than 1e-09 m"),
    ],
    ids=["no cells", "collapsed"],
)
def test_blocks_that_give_no_mesh_are_refused(change: dict[str, object], message: str, element: Element) -> None:
    with pytest.raises(MeshError, match=message):
        mesh_blocks([cube(**change)], element)


def test_named_points_take_corner_nodes_and_stations_must_hit_them() -> None:
    mesh = mesh_blocks([cube()], HEX20)
    named = add_named_points(mesh, {"here": np.array([0.26, 0.1, 0.1])})
    # The midside node at x = 0.25 is nearer, but it is no corner.
    np.testing.assert_allclose(named.points[named.node_sets["here"]], [[0.5, 0, 0]])
    hit = add_stations(mesh, {"line": np.array([[1.0, 0, 0], [0, 0, 0], [0.5, 0, 0]])})
    np.testing.assert_allclose(hit.points[hit.node_sets["line"], 0], [1, 0, 0.5])
    with pytest.raises(MeshError, match=r'station 2 of "line" is 2e\+05 um from the nearest corner node'):
        add_stations(mesh, {"line": np.array([[1.0, 0, 0], [0.2, 0, 0]])})


@given(drop_every=st.integers(2, 9), n=st.integers(1, 3))
def test_thinning_drops_every_kth_vertex_and_all_midside_nodes(drop_every: int, n: int) -> None:
    mesh = mesh_plain_blade(PlainBlade(), rule(HEX20, n, 6.0, 0.05))
    clamp = mesh.nodes("clamp")
    kept = thin_nodes(mesh, clamp, drop_every)
    vertices = np.intersect1d(clamp, mesh.corner_nodes())
    assert set(kept) <= set(vertices)
    assert len(vertices) - len(kept) == len(vertices) // drop_every


def test_thinning_does_not_depend_on_the_numbers_of_the_nodes() -> None:
    mesh = mesh_plain_blade(PlainBlade(), rule(HEX20, 1))
    new = np.random.default_rng(5).permutation(mesh.n_node)
    points = np.empty_like(mesh.points)
    points[new] = mesh.points
    renumbered = Mesh(points=points, cells={"hexahedron20": new[mesh.cells["hexahedron20"]]})
    clamp = mesh.nodes("clamp")
    np.testing.assert_array_equal(
        np.sort(new[thin_nodes(mesh, clamp, 3)]), np.sort(thin_nodes(renumbered, new[clamp], 3))
    )


def test_thinning_that_leaves_nothing_is_refused() -> None:
    mesh = mesh_plain_blade(PlainBlade(), rule(HEX8))
    with pytest.raises(SupportError, match="drop_every = 1: give 2 or more"):
        thin_nodes(mesh, mesh.nodes("clamp"), 1)
