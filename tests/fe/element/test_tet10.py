"""Bricks cut into tetrahedra: nothing is lost, and neighbours fit, whichever way their blocks run."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from fe.element import HEX20, TET10
from fe.mesh_quality import measure_cell_quality
from fe.mesher.block import Block, mesh_blocks
from tests.fe.surface import area_vectors, boundary, check_closed

Uvw = NDArray[np.float64]


def turned(order: tuple[int, int, int], flip: tuple[int, int, int], shift: float) -> Block:
    """A unit cube at x = shift whose own axes are permuted and reversed."""

    def shape(*uvw: Uvw) -> tuple[Uvw, Uvw, Uvw]:
        x, y, z = (1 - uvw[axis] if back else uvw[axis] for axis, back in zip(order, flip, strict=True))
        return x + shift, y, z

    counts = [0, 0, 0]
    for axis, count in zip(order, (1, 2, 3), strict=True):
        counts[axis] = count
    sides = {f"{'uvw'[order[0]]}{1 - flip[0] if shift else flip[0]}": "right" if shift else "left"}
    return Block(shape=shape, counts=(counts[0], counts[1], counts[2]), faces=sides)


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
@pytest.mark.parametrize("flip", [(0, 0, 0), (1, 0, 0), (0, 1, 1), (1, 1, 1)])
def test_blocks_that_run_in_any_direction_fit_their_neighbour(
    order: tuple[int, int, int], flip: tuple[int, int, int]
) -> None:
    mesh = mesh_blocks([turned((0, 1, 2), (0, 0, 0), 0.0), turned(order, flip, 1.0)], TET10)
    assert mesh.n_cell == 6 * 12
    # The outer surface is that of the box alone: no crack, no overlap between the two.
    check_closed(mesh)
    _, areas = area_vectors(mesh, boundary(mesh))
    assert areas.sum() == pytest.approx(10, rel=1e-12)
    quality = measure_cell_quality(mesh)
    assert quality.volume.sum() == pytest.approx(2, rel=1e-12)
    np.testing.assert_allclose(quality.determinant_ratio, 1, atol=1e-12)
    for name, x in (("left", 0.0), ("right", 2.0)):
        vectors, _ = area_vectors(mesh, mesh.face_sets[name])
        np.testing.assert_allclose(mesh.points[mesh.nodes(name), 0], x, atol=1e-12)
        np.testing.assert_allclose(vectors.sum(axis=0), [x - 1, 0, 0], atol=1e-12)


def test_every_node_of_a_curved_brick_stays_on_the_map() -> None:
    def shape(u: Uvw, v: Uvw, w: Uvw) -> tuple[Uvw, Uvw, Uvw]:
        return (1 + v) * np.cos(u), (1 + v) * np.sin(u), w

    block = Block(shape=shape, counts=(3, 2, 2), faces={"v1": "outside"})
    tetrahedra, bricks = (mesh_blocks([block], element) for element in (TET10, HEX20))
    on = tetrahedra.points[tetrahedra.nodes("outside")]
    np.testing.assert_allclose(np.hypot(on[:, 0], on[:, 1]), 2, atol=1e-14)
    assert len(on) == 7 * 5
    # A sector of 1 rad between radii 1 and 2: both miss its volume by the fourth power of the angle of a cell.
    for mesh in (tetrahedra, bricks):
        assert measure_cell_quality(mesh).volume.sum() == pytest.approx(1.5, rel=1e-4)
