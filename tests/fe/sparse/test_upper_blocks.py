"""A matrix of which half is stored is the whole matrix in all that it can do."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from fe.assembly import assemble, assemble_compact
from fe.element import HEX20, TET10
from fe.material import STEEL
from fe.mesh import Mesh
from fe.sparse import upper_blocks
from fe.sparse.factor import Definiteness
from fe.sparse.node_matrix import NodeMatrix
from fe.sparse.solver import Backend, factorise
from fe.sparse.symmetric_part import part, take_rows
from fe.sparse.upper_blocks import UpperBlocks

#: The order of a sum of about 200 products, against the largest of them.
ROUND_OFF = 1e-14

Random = np.random.Generator


@pytest.fixture
def random() -> Random:
    return np.random.default_rng(0)


def made_up(random: Random, n_node: int = 40) -> tuple[UpperBlocks, np.ndarray]:
    """Blocks at random places, and the matrix that they stand for, put together block by block."""
    couples = np.triu(random.random((n_node, n_node)) < 0.2, 1) | np.eye(n_node, dtype=bool)
    row, column = np.nonzero(couples)
    values = random.standard_normal((len(row), 3, 3))
    on = row == column
    values[on] = values[on] + values[on].swapaxes(1, 2)
    whole = np.zeros((n_node, 3, n_node, 3))
    for a, b, block in zip(row, column, values, strict=True):
        whole[a, :, b, :] = block
        whole[b, :, a, :] = block.T
    start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n_node))]).astype(np.int32)
    blocks = UpperBlocks(row_start=start, column=column.astype(np.int32), values=values)
    return blocks, whole.reshape(3 * n_node, 3 * n_node)


@pytest.fixture
def compact_and_whole(random: Random) -> tuple[UpperBlocks, np.ndarray]:
    return made_up(random)


def test_entries_diagonal_and_count(compact_and_whole) -> None:
    compact, whole = compact_and_whole
    np.testing.assert_array_equal(compact.toarray(), whole)
    np.testing.assert_array_equal(compact.diagonal(), np.diag(whole))
    assert compact.shape == whole.shape
    assert compact.nnz == np.count_nonzero(whole)
    np.testing.assert_array_equal(compact.graph().toarray() > 0, np.abs(whole[::3, ::3]) > 0)


@pytest.mark.parametrize("piece", [1, 7, 4096])
@pytest.mark.parametrize("columns", [(), (1,), (5,)])
def test_product(compact_and_whole, random: Random, monkeypatch, piece: int, columns: tuple[int, ...]) -> None:
    monkeypatch.setattr(upper_blocks, "PIECE", piece)
    compact, whole = compact_and_whole
    x = np.asfortranarray(random.standard_normal((len(whole), *columns)))
    scale = np.abs(whole).max() * np.abs(x).max() * len(whole)
    np.testing.assert_allclose(compact @ x, whole @ x, rtol=0, atol=ROUND_OFF * scale)


def test_rows_in_any_order_and_twice(compact_and_whole) -> None:
    compact, whole = compact_and_whole
    wanted = np.array([100, 3, 4, 5, 7, 3, 60])
    np.testing.assert_array_equal(compact.rows(wanted).toarray(), whole[wanted])
    for matrix in (compact, sp.csr_array(whole)):
        np.testing.assert_array_equal(take_rows(matrix, wanted).toarray(), whole[wanted])


def test_the_part_of_whole_nodes_is_stored_as_the_matrix_is(compact_and_whole) -> None:
    compact, whole = compact_and_whole
    nodes = np.array([2, 3, 11, 39])
    rows = (3 * nodes[:, None] + np.arange(3)).ravel()
    result = part(compact, rows)
    assert isinstance(result, UpperBlocks)
    np.testing.assert_array_equal(result.toarray(), whole[np.ix_(rows, rows)])


@pytest.mark.parametrize("rows", [[0, 1, 2, 4], [1, 2, 3], [0, 1, 3], [5], [], [6, 7, 8, 3, 4, 5]])
def test_other_parts_are_cut_out_of_both_triangles(compact_and_whole, rows: list[int]) -> None:
    compact, whole = compact_and_whole
    result = part(compact, np.array(rows, dtype=np.int64))
    np.testing.assert_array_equal(result.toarray(), whole[np.ix_(rows, rows)])


def test_springs_on_the_diagonal_leave_the_matrix_as_it_was(compact_and_whole, random: Random) -> None:
    compact, whole = compact_and_whole
    springs = random.random(len(whole))
    np.testing.assert_array_equal(compact.plus_diagonal(springs).toarray(), whole + np.diag(springs))
    np.testing.assert_array_equal(compact.toarray(), whole)


def test_a_node_matrix_is_the_same_in_each_direction(random: Random) -> None:
    nodes = random.standard_normal((6, 6)) * (random.random((6, 6)) < 0.5)
    nodes += nodes.T
    matrix, whole = NodeMatrix(nodes=sp.csr_array(nodes)), np.kron(nodes, np.eye(3))
    np.testing.assert_array_equal(matrix.toarray(), whole)
    np.testing.assert_array_equal(matrix.diagonal(), np.diag(whole))
    assert matrix.shape == whole.shape
    for x in (random.standard_normal(18), np.asfortranarray(random.standard_normal((18, 4)))):
        np.testing.assert_allclose(matrix @ x, whole @ x, rtol=0, atol=20 * ROUND_OFF * np.abs(nodes).max())
    np.testing.assert_array_equal(part(matrix, np.arange(3, 12)).toarray(), whole[3:12, 3:12])
    np.testing.assert_array_equal(part(matrix, np.arange(4, 12)).toarray(), whole[4:12, 4:12])


@pytest.mark.parametrize("kind", [HEX20, TET10], ids=lambda kind: kind.name)
def test_both_ways_to_assemble_are_one_matrix(box, kind) -> None:
    mesh = box(kind, distortion=0.2)
    for compact, whole in zip(assemble_compact(mesh, STEEL), assemble(mesh, STEEL), strict=True):
        assert abs(compact.tocsr() - whole).max() == 0
        assert abs(whole - whole.T).max() == 0
    mass, stiffness = assemble_compact(mesh, STEEL)
    assert memory(stiffness) < 0.4 * memory(stiffness.tocsr())
    assert memory(mass.nodes) < 0.4 * memory(mass.tocsr())


@pytest.mark.parametrize("place", [0, 5, None], ids=["first", "inner", "last"])
def test_a_node_without_cells_has_zeros_and_takes_springs(box, place: int | None) -> None:
    mesh = box(HEX20, counts=(2, 2, 2))
    unused = mesh.n_node if place is None else place
    number = np.arange(mesh.n_node) + (np.arange(mesh.n_node) >= unused)
    points = np.insert(mesh.points, unused, [9.0, 9.0, 9.0], axis=0)
    widened = Mesh(points=points, cells={"hexahedron20": number[mesh.cells["hexahedron20"]]})
    rows = np.setdiff1d(np.arange(3 * widened.n_node), 3 * unused + np.arange(3))
    for result, expected in zip(assemble_compact(widened, STEEL), assemble(mesh, STEEL), strict=True):
        whole = np.zeros(result.shape)
        whole[np.ix_(rows, rows)] = expected.toarray()
        np.testing.assert_array_equal(result.toarray(), whole)
        np.testing.assert_array_equal(result.diagonal(), np.diag(whole))
    springs = np.zeros(3 * widened.n_node)
    springs[3 * unused + 1] = 1e6
    stiffness = assemble_compact(widened, STEEL)[1]
    np.testing.assert_array_equal(stiffness.plus_diagonal(springs).diagonal(), stiffness.diagonal() + springs)


def memory(matrix: UpperBlocks | sp.csr_array) -> int:
    if isinstance(matrix, UpperBlocks):
        return matrix.values.nbytes + matrix.column.nbytes + matrix.row_start.nbytes
    return int(matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes)


@pytest.mark.parametrize("counts", [(3, 3, 3), (12, 6, 6)], ids=["small", "in blocks"])
@pytest.mark.parametrize("definiteness", list(Definiteness), ids=lambda each: each.name.lower())
def test_every_back_end_factorises_it(
    box, backend: Backend, random: Random, counts: tuple[int, int, int], definiteness: Definiteness
) -> None:
    held = assemble_compact(box(HEX20, counts=counts), STEEL)[1]
    held = held.plus_diagonal(np.full(held.shape[0], 1e-3 * held.diagonal().mean()))
    b = random.standard_normal((held.shape[0], 3))
    x = factorise(held, definiteness, backend).solve(b)
    # The springs leave a condition number of about 1e4.
    np.testing.assert_allclose(held @ x, b, rtol=0, atol=1e-10 * np.abs(b).max())


def test_a_factor_of_half_a_matrix_takes_new_values(box, backend: Backend, random: Random) -> None:
    stiffness = assemble_compact(box(HEX20, counts=(12, 6, 6)), STEEL)[1]
    springs = np.full(stiffness.shape[0], 1e-3 * stiffness.diagonal().mean())
    first, second = (stiffness.plus_diagonal(k * springs) for k in (1, 3))
    factor = factorise(first, backend=backend)
    b = random.standard_normal(stiffness.shape[0])
    for other in (second, first.tocsr()):
        factor.renew(other)
        np.testing.assert_allclose(other @ factor.solve(b), b, rtol=0, atol=1e-10 * np.abs(b).max())


def test_what_is_no_upper_triangle_is_refused(compact_and_whole, random: Random) -> None:
    compact, whole = compact_and_whole
    with pytest.raises(ValueError, match="begins on the diagonal"):
        replace(compact, column=compact.column[::-1])
    row = int(np.flatnonzero(np.diff(compact.row_start) > 2)[0])
    column = compact.column.copy()
    first = compact.row_start[row]
    column[[first + 1, first + 2]] = column[[first + 2, first + 1]]
    with pytest.raises(ValueError, match="columns ascend"):
        replace(compact, column=column)
    for matrix in (compact, NodeMatrix(nodes=sp.csr_array(np.eye(40)))):
        with pytest.raises(ValueError, match="cannot be multiplied by columns of shape"):
            matrix @ random.standard_normal(2 * len(whole))


def test_other_kinds_of_numbers(compact_and_whole, random: Random) -> None:
    compact, whole = compact_and_whole
    wide = replace(
        compact,
        row_start=compact.row_start.astype(np.int64),
        column=compact.column.astype(np.int64),
        values=np.asfortranarray(compact.values),
    )
    np.testing.assert_array_equal(wide.toarray(), whole)
    assert wide.column.dtype == np.int32
    z = random.standard_normal(len(whole)) + 1j * random.standard_normal(len(whole))
    np.testing.assert_allclose(compact @ z, whole @ z, rtol=0, atol=ROUND_OFF * len(whole) * np.abs(whole).max() * 4)
