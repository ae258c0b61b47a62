"""The relaxed clamp: which nodes it keeps, whatever the mesh calls them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fe.element import HEX8, HEX20, Element
from fe.errors import SupportError
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.node_sets import thin_nodes

COUNTS = (4, 2, 6)


def plate(element: Element) -> Mesh:
    """A box whose two faces normal to y are clamped, at coordinates that are no round numbers."""

    def shape(*uvw: np.ndarray) -> tuple[np.ndarray, ...]:
        return tuple(size * part - size / 3 for size, part in zip((0.06, 0.016, 0.03), uvw, strict=True))

    return mesh_blocks([Block(shape=shape, counts=COUNTS, faces={"v0": "clamp", "v1": "clamp"})], element)


def renumbered(mesh: Mesh, seed: int) -> tuple[Mesh, np.ndarray]:
    """The same mesh with its nodes in another order, each moved by less than a thousandth of the sorting step."""
    generator = np.random.default_rng(seed)
    new = generator.permutation(mesh.n_node)
    points = np.empty_like(mesh.points)
    # What another machine's arithmetic does to coordinates of a few centimetres.
    points[new] = mesh.points + generator.uniform(-1e-15, 1e-15, mesh.points.shape)
    cells = {cell_type: new[nodes] for cell_type, nodes in mesh.cells.items()}
    return Mesh(points=points, cells=cells, face_sets=mesh.face_sets), new


@pytest.mark.parametrize("drop_every", [2, 3, 6, 1000])
def test_of_the_vertices_every_kth_is_free_and_midside_nodes_are_never_held(drop_every: int) -> None:
    linear, quadratic = plate(HEX8), plate(HEX20)
    n_vertex = 2 * (COUNTS[0] + 1) * (COUNTS[2] + 1)
    assert len(linear.nodes("clamp")) == n_vertex
    kept = thin_nodes(quadratic, quadratic.nodes("clamp"), drop_every)
    assert len(kept) == n_vertex - n_vertex // drop_every
    assert np.isin(kept, quadratic.corner_nodes()).all()
    assert np.isin(kept, quadratic.nodes("clamp")).all()
    # Both elements have the same vertices, so the same places are held.
    same = thin_nodes(linear, linear.nodes("clamp"), drop_every)
    near = [np.abs(linear.points[same] - place).max(axis=1).min() for place in quadratic.points[kept]]
    assert max(near) < 1e-15


def test_the_dropped_ones_are_every_kth_by_x_then_y_then_z() -> None:
    mesh = plate(HEX8)
    nodes = mesh.nodes("clamp")
    by_hand = sorted(nodes, key=lambda node: tuple(mesh.points[node].round(9)))
    dropped = np.setdiff1d(nodes, thin_nodes(mesh, nodes, 6))
    np.testing.assert_array_equal(np.sort(dropped), np.sort(by_hand[5::6]))


@given(seed=st.integers(0, 2**32 - 1), drop_every=st.integers(2, 9))
def test_the_choice_depends_on_places_and_not_on_numbers_or_round_off(seed: int, drop_every: int) -> None:
    mesh = plate(HEX20)
    other, new = renumbered(mesh, seed)
    kept, other_kept = (thin_nodes(item, item.nodes("clamp"), drop_every) for item in (mesh, other))
    np.testing.assert_array_equal(np.sort(new[kept]), other_kept)


@pytest.mark.parametrize("drop_every", [2, 3, 5, 6])
def test_the_choice_is_uniform_over_the_faces(drop_every: int) -> None:
    # Along the sorted order a run of m nodes loses m / k of them, give or take one: no patch is left without support.
    mesh = plate(HEX8)
    nodes = mesh.nodes("clamp")
    free = np.setdiff1d(nodes, thin_nodes(mesh, nodes, drop_every))
    for column in np.unique(mesh.points[nodes, 0].round(9)):
        here = np.abs(mesh.points[nodes, 0] - column) < 1e-9
        lost = np.isin(nodes[here], free).sum()
        assert abs(lost - here.sum() / drop_every) < 1
    for side in (-1, 1):
        here = side * (mesh.points[nodes, 1] - mesh.points[nodes, 1].mean()) > 0
        # Each of the five columns of a face may be one off.
        assert abs(np.isin(nodes[here], free).sum() - here.sum() / drop_every) < COUNTS[0] + 1


@pytest.mark.parametrize("drop_every", [1, 0, -3])
def test_a_step_that_leaves_nothing_is_refused_with_its_value(drop_every: int) -> None:
    mesh = plate(HEX8)
    with pytest.raises(SupportError, match=f"drop_every = {drop_every}: give 2 or more"):
        thin_nodes(mesh, mesh.nodes("clamp"), drop_every)
