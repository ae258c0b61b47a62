"""Matrices of another program as a linear system: the right rows, the right units, and a sentence for each mistake."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.linalg
import scipy.sparse as sp

from fe.calculix_run import find_ccx
from fe.errors import MatrixFileError
from fe.file.dof_table import DofLabels, numbered, read_dof_table
from fe.file.imported_matrices import ImportedMatrices, Units, read_matrices
from fe.file.matrix_file import MatrixSource
from fe.modal import MAX_DENSE, modes
from fe.sparse.solver import Backend, choose_backend

#: A beam of steel, 10 x 10 mm, clamped at its first node; 12 cubic elements.
LENGTH, EI, RHO_A, N_ELEMENT = 0.5, 210e9 * 1e-8 / 12, 7800 * 1e-4, 12


def beam(length_unit: float) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness of deflections and rotations, in SI or in mm, tonne, N."""
    h, ei = LENGTH / N_ELEMENT / length_unit, EI / length_unit**2
    # rho A is a mass per length: kg/m, or tonne/mm.
    rho_a = RHO_A if length_unit == 1 else RHO_A * 1e-3 * 1e-3
    stiffness = ei / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h], [-12, -6 * h, 12, -6 * h],
         [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    )  # fmt: skip
    mass = rho_a * h / 420 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h], [54, 13 * h, 156, -22 * h],
         [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
    )  # fmt: skip
    n = 2 * (N_ELEMENT + 1)
    whole = np.zeros((2, n, n))
    for element in range(N_ELEMENT):
        place = slice(2 * element, 2 * element + 4)
        whole[0, place, place] += mass
        whole[1, place, place] += stiffness
    return whole[0], whole[1]


#: Labels of the program that wrote the matrices: they descend along the beam.
NODE = np.repeat(100 - np.arange(N_ELEMENT + 1), 2)
DIRECTION = np.tile([2, 4], N_ELEMENT + 1)


def write(folder: Path, mass: np.ndarray, stiffness: np.ndarray) -> dict[str, MatrixSource]:
    scipy.io.mmwrite(folder / "m.mtx", sp.coo_array(mass), precision=17, symmetry="general")
    scipy.io.mmwrite(folder / "k.mtx", sp.coo_array(stiffness), precision=17, symmetry="general")
    return {"mass": MatrixSource(file=folder / "m.mtx"), "stiffness": MatrixSource(file=folder / "k.mtx")}


def table(folder: Path, node: np.ndarray = NODE, name: str = "dofs.csv") -> Path:
    words = ("x", "y", "z", "rotx", "roty", "rotz")
    lines = [f"{k},{n},{words[d]}" for k, (n, d) in enumerate(zip(node, DIRECTION, strict=True))]
    (folder / name).write_text("\n".join(["dof,node,direction", *reversed(lines)]))
    return folder / name


def clamped(read: ImportedMatrices) -> np.ndarray:
    held = read.dofs.rows([100], range(6))
    return modes(read.system(held).linear, 3).frequency


@pytest.mark.parametrize("units", list(Units))
def test_an_imported_beam_has_the_frequencies_of_the_closed_form(tmp_path: Path, units: Units) -> None:
    read = read_matrices(**write(tmp_path, *beam(units.value)), dofs=table(tmp_path), units=units)
    # Roots of cosh(b) cos(b) = -1; elements of length h are too stiff by (b h / L)^4 / 1440, 1.3e-4 on the third.
    roots = np.array([1.875104068711961, 4.694091132974175, 7.854757438237613])
    exact = (roots / LENGTH) ** 2 * np.sqrt(EI / RHO_A) / (2 * np.pi)
    error = (roots / N_ELEMENT) ** 4 / 1440
    np.testing.assert_allclose(clamped(read) / exact - 1, error, rtol=0.05)  # its next term is of order (b h / L)^6


def test_millimetres_and_metres_give_the_same_matrices(tmp_path: Path) -> None:
    (tmp_path / "mm").mkdir()
    metre = read_matrices(**write(tmp_path, *beam(1.0)), dofs=table(tmp_path))
    millimetre = read_matrices(**write(tmp_path / "mm", *beam(1e-3)), dofs=table(tmp_path), units=Units.MILLIMETRE)
    for name in ("mass", "stiffness"):
        want = getattr(metre, name).toarray()
        np.testing.assert_allclose(getattr(millimetre, name).toarray(), want, rtol=1e-12, atol=1e-15 * want.max())


def test_rows_follow_the_table_and_rotations_have_nodes_of_their_own(tmp_path: Path) -> None:
    read = read_matrices(**write(tmp_path, *beam(1.0)), dofs=table(tmp_path))
    imported = read.system(read.dofs.rows([100], [2, 4]))
    linear, row = imported.linear, imported.row
    assert linear.n_node == 2 * (N_ELEMENT + 1)
    assert (np.diff(linear.free) > 0).all()
    assert row[:2].tolist() == [-1, -1]
    kept = np.arange(2, 2 * (N_ELEMENT + 1))
    np.testing.assert_array_equal(
        linear.stiffness[row[kept]][:, row[kept]].toarray(), read.stiffness[kept][:, kept].toarray()
    )
    # The free end has the least label: node 0, direction z; its rotation about y is on the first of the others.
    assert linear.free[row[2 * N_ELEMENT]] == 2
    assert linear.free[row[2 * N_ELEMENT + 1]] == 3 * (N_ELEMENT + 1) + 1


def test_without_a_table_row_k_is_node_k(tmp_path: Path) -> None:
    read = read_matrices(**write(tmp_path, np.eye(3), 2 * np.eye(3)))
    assert read.dofs.name(2) == "node 2 x"
    linear = read.system(np.zeros(0, dtype=np.int64)).linear
    assert linear.free.tolist() == [0, 3, 6]
    assert not linear.damping.nnz


MASS_CARDS = "DMIG,MAAX,0,6,2,0\nDMIG,MAAX,5,1,,5,1,3.\nDMIG,MAAX,2,3,,2,3,4.\n"
STIFFNESS_CARDS = "DMIG,KAAX,0,6,2,0\nDMIG,KAAX,5,1,,5,1,7.,\n,2,3,-1.\nDMIG,KAAX,2,3,,2,3,8.\nDMIG,KAAX,9,0,,9,0,6.\n"


def test_cards_that_name_different_degrees_of_freedom_are_united(tmp_path: Path) -> None:
    (tmp_path / "model.pch").write_text(MASS_CARDS + STIFFNESS_CARDS)
    mass, stiffness = (MatrixSource(file=tmp_path / "model.pch", name=name) for name in ("MAAX", "KAAX"))
    read = read_matrices(mass, stiffness)
    assert [read.dofs.name(row) for row in range(3)] == ["node 2 z", "node 5 x", "node 9 x"]
    np.testing.assert_array_equal(read.mass.toarray(), np.diag([4.0, 3.0, 0.0]))
    np.testing.assert_array_equal(read.stiffness.toarray(), [[8.0, -1.0, 0.0], [-1.0, 7.0, 0.0], [0.0, 0.0, 6.0]])


MAPPING = """\
 Matrix Eqn      Node        DOF
         1          12         UX
         3          12       ROTZ
         2           7         UY
"""


def test_the_mapping_of_ansys_names_each_equation(tmp_path: Path) -> None:
    (tmp_path / "k.mapping").write_text(MAPPING)
    read = read_dof_table(tmp_path / "k.mapping")
    assert [read.name(row) for row in range(3)] == ["node 12 x", "node 7 y", "node 12 rotz"]
    assert read.rows([12, 7], [0, 1, 5]).tolist() == [0, 2, 1]


#: Two bricks in mm, tonne and N, one edge held and a third corner kept from turning about it.
DECK = """\
*NODE
1,0,0,0
2,3,0,0
3,3,2,0
4,0,2,0
5,0,0,1
6,3,0,1
7,3,2,1
8,0,2,1
19,6,0,0
13,6,2,0
16,6,0,1
17,6,2,1
*ELEMENT,TYPE=C3D8,ELSET=E
1,1,2,3,4,5,6,7,8
2,2,19,13,3,6,16,17,7
*BOUNDARY
1,1,3
4,1,3
5,1,1
*MATERIAL,NAME=S
*ELASTIC
210000,0.3
*DENSITY
7.8e-9
*SOLID SECTION,ELSET=E,MATERIAL=S
*STEP
*FREQUENCY,SOLVER=MATRIXSTORAGE
5
*END STEP
"""


@pytest.mark.calculix
@pytest.mark.skipif(find_ccx() is None, reason="CalculiX (ccx) is not installed")
def test_the_matrices_of_calculix_have_the_frequencies_of_calculix(tmp_path: Path) -> None:
    run = {"cwd": tmp_path, "capture_output": True, "timeout": 60, "check": False}
    (tmp_path / "d.inp").write_text(DECK)
    subprocess.run(["ccx", "d"], **run)
    mass, stiffness = (MatrixSource(file=tmp_path / f"d.{ending}") for ending in ("mas", "sti"))
    read = read_matrices(mass, stiffness, dofs=tmp_path / "d.dof", units=Units.MILLIMETRE)
    assert read.dofs.n_dof == 3 * 12 - 7
    nothing = np.zeros(0, dtype=np.int64)
    result = modes(read.system(nothing).linear, 5).frequency
    (tmp_path / "f.inp").write_text(DECK.replace(",SOLVER=MATRIXSTORAGE", ""))
    subprocess.run(["ccx", "f"], **run)
    lines = (tmp_path / "f.dat").read_text().splitlines()
    table = [line.split() for line in lines if len(line.split()) == 5 and line.split()[0].isdigit()]
    # Mode, eigenvalue, rad/s, Hz and an imaginary part, with seven digits.
    np.testing.assert_allclose(result, [float(row[3]) for row in table[:5]], rtol=1e-6)


def test_matrices_that_are_not_symmetric_are_refused_by_their_worst_entry(tmp_path: Path) -> None:
    mass, stiffness = beam(1.0)
    stiffness[3, 5] *= 1.001
    with pytest.raises(
        MatrixFileError, match=r"stiffness is not symmetric, worst between node 99 roty and node 98 roty"
    ):
        read_matrices(**write(tmp_path, mass, stiffness), dofs=table(tmp_path))
    mass[3, 5] *= 1.001
    stiffness[3, 5] = stiffness[5, 3]
    with pytest.raises(MatrixFileError, match=r"the mass is not symmetric.* \(3, 5\) and \(5, 3\)"):
        read_matrices(**write(tmp_path, mass, stiffness), dofs=table(tmp_path))


def test_one_triangle_alone_is_told(tmp_path: Path) -> None:
    whole = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    with pytest.raises(
        MatrixFileError, match="the stiffness contains only one triangle and is not marked as symmetric"
    ):
        read_matrices(**write(tmp_path, np.eye(3), np.triu(whole)))


def test_matrices_and_tables_of_other_sizes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MatrixFileError, match=r"the mass has 3 rows, but the stiffness of .*k\.mtx\" has 2 rows"):
        read_matrices(**write(tmp_path, np.eye(3), np.eye(2)))
    whole = np.eye(26)
    with pytest.raises(MatrixFileError, match=r'm\.mtx": the mass has 3 rows, but .*csv" has 26 degrees of freedom'):
        read_matrices(**write(tmp_path, np.eye(3), whole), dofs=table(tmp_path))
    with pytest.raises(MatrixFileError, match=r'k\.mtx": the stiffness has 3 rows, but .*csv" has 26 degrees of free'):
        read_matrices(**write(tmp_path, whole, np.eye(3)), dofs=table(tmp_path))
    with pytest.raises(MatrixFileError, match="lists 26 degrees of freedom, but the matrices have 3 rows"):
        read_matrices(**write(tmp_path, np.eye(3), np.eye(3)), dofs=table(tmp_path))
    (tmp_path / "m.pch").write_text(MASS_CARDS)
    cards, plain = MatrixSource(file=tmp_path / "m.pch"), MatrixSource(file=tmp_path / "k.mtx")
    with pytest.raises(MatrixFileError, match="give all matrices as DMIG cards"):
        read_matrices(cards, plain)


def test_what_carries_no_or_negative_stiffness_or_mass_is_refused_by_name(tmp_path: Path) -> None:
    nothing = np.zeros(0, dtype=np.int64)
    read = read_matrices(**write(tmp_path, np.diag([1.0, 0.0, 0.0]), np.diag([1.0, 2.0, 3.0])))
    with pytest.raises(MatrixFileError, match="node 1 x and 1 others have no mass"):
        read.system(nothing)
    assert read.system(np.array([1, 2])).linear.n_dof == 1
    read = read_matrices(**write(tmp_path, np.eye(3), np.diag([1.0, 2.0, 0.0])))
    with pytest.raises(MatrixFileError, match="node 2 x has no stiffness"):
        read.system(nothing)
    read = read_matrices(**write(tmp_path, np.eye(3), np.diag([1.0, -2.0, 1.0])))
    with pytest.raises(MatrixFileError, match="node 1 x has a stiffness of -2 on the diagonal: check its sign"):
        read.system(nothing)
    with pytest.raises(MatrixFileError, match="fix every degree of freedom"):
        read.system(np.arange(3))


INDEFINITE = np.array([[1.0, 2.0], [2.0, 1.0]])


@pytest.mark.parametrize("copies", [1, MAX_DENSE])  # by eigenvalues, and by a factorisation
@pytest.mark.parametrize(
    ("mass", "stiffness", "message"),
    [
        (np.eye(2), INDEFINITE, "the stiffness is indefinite, .*: check its signs and units"),
        (INDEFINITE, np.eye(2), "the mass is not positive definite: .*; check signs and units"),
    ],
)
def test_indefinite_matrices_are_refused(mass: np.ndarray, stiffness: np.ndarray, message: str, copies: int) -> None:
    if copies > 1 and choose_backend() is Backend.SUPERLU:
        pytest.skip("SuperLU does not notice negative pivots")
    many = {
        name: sp.csr_array(sp.block_diag([item] * copies)) for name, item in (("mass", mass), ("stiffness", stiffness))
    }
    read = ImportedMatrices(**many, damping=sp.csr_array(many["mass"].shape), dofs=numbered(2 * copies))
    with pytest.raises(MatrixFileError, match=message):
        read.system(np.zeros(0, dtype=np.int64))


@pytest.mark.parametrize("n", [3, 2 * MAX_DENSE])
def test_a_free_structure_in_single_precision_is_not_taken_for_an_indefinite_one(n: int) -> None:
    # Springs of 1/3 to 1/(n + 2) N/m, rounded entry by entry: rigid motions have a stiffness of either sign.
    spring = 1 / np.arange(3.0, n + 2)
    diagonal = np.append(spring, 0) + np.append(0, spring)
    stiffness = sp.csr_array(sp.diags_array([-spring, diagonal, -spring], offsets=[-1, 0, 1]).astype(np.float32))
    free = ImportedMatrices(
        mass=sp.csr_array(sp.eye_array(n)), damping=sp.csr_array((n, n)),
        stiffness=stiffness.astype(np.float64), dofs=numbered(n),
    )  # fmt: skip
    assert free.system(np.zeros(0, dtype=np.int64)).linear.n_dof == n


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("d.csv", "dof,node\n0,1\n", "has no column direction, it has dof, node"),
        ("d.csv", "dof,node,direction\n", "lists no row"),
        ("d.csv", "dof,node,direction\n0,1,x\n1,1,w\n", 'line 3: cannot read "1, 1, w": "w" is not a direction'),
        ("d.csv", "dof,node,direction\n0,one,x\n", 'line 2: cannot read "0, one, x": give whole numbers'),
        ("d.csv", "dof,node,direction\n0,1,x\n0,2,x\n", "has the row 0 twice"),
        ("d.csv", "dof,node,direction\n1,1,x\n2,2,x\n", "counts its rows from 1: count them from 0"),
        ("d.csv", "dof,node,direction\n0,1,x\n2,2,x\n", "has the row 2 without a row of that number before it"),
        ("d.csv", "dof,node,direction\n0,1,x\n1,1,x\n", "rows 0 and 1 both belong to node 1 x"),
        ("d.mapping", "Matrix Eqn Node DOF\n", "lists no equation"),
        ("d.mapping", MAPPING.replace("ROTZ", "TEMP"), 'line 3: "TEMP" is not a direction'),
        (
            "d.csv",
            "dof,node,direction\n0,2147483648,x\n",
            "row 0 belongs to node 2147483648, but nodes are 0 to 2147483647",
        ),
        ("d.csv", f"dof,node,direction\n0,1,x\n1,{10**30},x\n", f"row 1 belongs to node {10**30}, but"),
        ("d.csv", "dof,node,direction\n0,-1,x\n", "row 0 belongs to node -1, but nodes are 0"),
        ("d.csv", f"dof,node,direction\n0,{'9' * 5000},x\n", 'line 2: cannot read "0, 9{40}, x": give whole numbers'),
        ("d.csv", f"dof,node,direction\n0,{'9' * 140000},x\n", r"d\.csv\" is not a table \(field larger than"),
        ("d.mapping", MAPPING.replace("7 ", "9" * 20 + " "), "row 1 belongs to node 9{20}, but"),
        ("d.mapping", MAPPING.replace("7 ", "9" * 5000 + " "), 'line 4: cannot read "'),
        ("d.dof", f"{2**63 - 1}.1\n", f"row 0 belongs to node {2**63 - 1}, but"),
        ("d.dof", "9" * 5000 + ".1\n", 'line 1: cannot read "9{40}": give node.direction'),
        ("d.dof", "12.1\n12\n", 'line 2: cannot read "12": give node.direction'),
        ("d.dof", "", "lists no row"),
        ("d.txt", "", r'ends in "\.txt": give degrees of freedom as \.csv, \.mapping or'),
    ],
)
def test_a_table_that_does_not_name_every_row_is_refused(tmp_path: Path, name: str, text: str, message: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(MatrixFileError, match=message):
        read_dof_table(tmp_path / name)


def test_nodes_and_directions_that_no_row_has_are_refused() -> None:
    dofs = DofLabels(node=np.array([4, 4]), direction=np.array([0, 3]))
    with pytest.raises(MatrixFileError, match="node 4 has no degree of freedom y, z: it has x, rotx"):
        dofs.rows([4], [1, 2])
    with pytest.raises(MatrixFileError, match="node 5 has no degree of freedom x: no row belongs to it"):
        dofs.rows([4, 5], [0])
    assert numbered(3).rows([2, 0], [0]).tolist() == [2, 0]
    with pytest.raises(MatrixFileError, match="there is no file"):
        read_dof_table("none.csv")


def test_columns_of_a_table_may_be_parted_by_semicolons(tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text("dof;node;direction\n0;4;x\n1;4;rotz\n")
    read = read_dof_table(tmp_path / "d.csv")
    assert (read.node.tolist(), read.direction.tolist()) == ([4, 4], [0, 5])


def test_matrices_of_abaqus_have_the_frequencies_of_those_that_were_written(tmp_path: Path) -> None:
    labels = [(node, axis) for node in (7, 1, 2) for axis in (1, 6)]  # not in the order of the numbers
    triangle = {(2, 0): -1e4, (4, 2): -1e4, (0, 0): 2e4, (2, 2): 2e4, (4, 4): 1e4} | {(k, k): 5.0 for k in (1, 3, 5)}
    for name, entries in (("STIF", triangle), ("MASS", {(k, k): 1.0 + k for k in range(6)})):
        lines = [f"{','.join(map(str, labels[a] + labels[b]))}, {value:.15e}" for (a, b), value in entries.items()]
        (tmp_path / f"JOB_{name}1.mtx").write_text("** a comment\n" + "\n".join(lines) + "\n")
    result = read_matrices(*(MatrixSource(file=tmp_path / f"JOB_{name}1.mtx") for name in ("MASS", "STIF")))
    assert result.dofs.rows([1, 7], [5]).tolist() == [1, 5]
    by_hand = np.zeros((6, 6))
    for (a, b), value in triangle.items():
        by_hand[a, b] = by_hand[b, a] = value
    expected = scipy.linalg.eigvalsh(by_hand, np.diag(1.0 + np.arange(6)))
    squared = scipy.linalg.eigvalsh(result.stiffness.toarray(), result.mass.toarray())
    np.testing.assert_allclose(squared, expected, rtol=1e-9)  # 15 digits in the files; round-off
