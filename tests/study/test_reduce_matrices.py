"""`stickslip reduce` of matrices: from MatrixMarket files to a model that `stickslip solve` takes, against a beam."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from reduction.file.rom_hdf5 import load_rom
from study.cli import main

#: A cantilever of steel, 10 x 10 mm, in mm, tonne and N: deflections z and rotations about y of nodes 1 to 31.
LENGTH, SIDE, YOUNG, DENSITY, N_ELEMENT = 500.0, 10.0, 210e3, 7.8e-9, 30
EI, RHO_A = YOUNG * SIDE**4 / 12, DENSITY * SIDE**2
ROOTS = np.array([1.875104068711961, 4.694091132974175, 7.854757438237613])
EXACT = (ROOTS / LENGTH) ** 2 * np.sqrt(EI / RHO_A) / (2 * np.pi)
#: Cubic elements of length h are too stiff by (b h / L)^4 / 1440: 3e-6 on the third frequency.
TOO_STIFF = (ROOTS / N_ELEMENT) ** 4 / 1440
#: Round-off of an eigenvalue is that of the largest, for a cubic element 8400 EI / (rho A h^4); of a frequency, half.
ROUND_OFF = np.finfo(float).eps / 2 * 8400 * (N_ELEMENT / ROOTS) ** 4
CASE = """\
schema = 2
title = "Cantilever"
[structure]
kind = "matrices"
[structure.files]
mass = "m.mtx"
stiffness = "k.mtx"
dofs = "dofs.csv"
units = "mm, tonne, s"
[[structure.support]]
nodes = [1]
[[structure.boundary]]
name = "tip"
nodes = [31]
directions = ["z", "roty"]
[[structure.boundary]]
name = "middle"
nodes = [16]
[structure.reduction]
modes = 12
[structure.damping]
ratio = "1 %"
"""
WHAT_TO_SOLVE = """\
[[load]]
at = "tip"
direction = "z"
amplitude = "1 N"
[[sensor]]
name = "tip"
at = "tip"
direction = "z"
[harmonics]
highest = 1
[sweep]
from = "32 Hz"
to = "35 Hz"
step = "0.01 Hz"
"""
#: The same from the reduced model that was stored.
STORED = f"""\
schema = 2
[structure]
kind = "plain"
file = "out/beam_rom.h5"
{WHAT_TO_SOLVE}"""


def write_beam(folder: Path) -> None:
    h, n = LENGTH / N_ELEMENT, 2 * (N_ELEMENT + 1)
    stiffness = EI / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h], [-12, -6 * h, 12, -6 * h],
         [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    )  # fmt: skip
    mass = RHO_A * h / 420 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h], [54, 13 * h, 156, -22 * h],
         [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
    )  # fmt: skip
    for name, element in (("m", mass), ("k", stiffness)):
        whole = np.zeros((n, n))
        for number in range(N_ELEMENT):
            whole[2 * number : 2 * number + 4, 2 * number : 2 * number + 4] += element
        scipy.io.mmwrite(folder / f"{name}.mtx", sp.coo_array(whole), precision=17, symmetry="symmetric")
    rows = [f"{k},{k // 2 + 1},{'z' if k % 2 == 0 else 'roty'}" for k in range(n)]
    (folder / "dofs.csv").write_text("\n".join(["dof,node,direction", *rows]))
    scipy.io.mmwrite(folder / "odd.mtx", sp.coo_array(np.ones((2, 3))))
    scipy.io.mmwrite(folder / "small.mtx", sp.coo_array(np.eye(2)))
    (folder / "few.csv").write_text("dof,node,direction\n0,1,x\n")
    (folder / "bad.csv").write_text("dof,node,direction\n0,1,u\n")
    (folder / "beam.toml").write_text(CASE)


@pytest.fixture
def home(at_home: Path) -> Path:
    write_beam(at_home)
    return at_home


def stickslip(*words: str) -> int:
    return main([*words, "--quiet"])


def test_a_beam_in_millimetres_is_reduced_to_the_frequencies_of_the_closed_form(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert stickslip("reduce", "beam.toml", "--out", "out", "--json", "--check") == 0
    document = json.loads(capfd.readouterr().out)
    check = document["mode_check"]
    # Twelve modes, of which the one above the highest gap is not counted.
    assert check["n_below"] == check["n_found"] == 11
    assert check["largest_residual"] < 1e-8
    assert (document["n_dof"], document["n_reduced"]) == (60, 3 + 12)
    too_stiff = np.array(document["frequency_hz"][:3]) / EXACT - 1
    np.testing.assert_array_less(np.abs(too_stiff - TOO_STIFF), 0.05 * TOO_STIFF + ROUND_OFF)
    truncation = np.array(document["rom_frequency_hz"]) / document["frequency_hz"] - 1
    # The estimate errs to the low side by a few per cent; all six are as round as the first mode at worst.
    np.testing.assert_allclose(truncation[:6], document["rom_error"][:6], rtol=0.2, atol=ROUND_OFF[0])
    assert truncation[:3].max() < 1e-5
    rom = load_rom(home / "out" / "beam_rom.h5")
    assert rom.rows("tip", 2).tolist() == [0]
    assert rom.rows("tip rotation", 1).tolist() == [1]
    assert rom.rows("middle").tolist() == [2]
    # A static force on the tip: L^3 / (3 EI), here in m/N; the reduction is exact at the boundary.
    tip = np.linalg.solve(rom.stiffness, np.eye(rom.n_dof)[:, 0])
    assert tip[0] == pytest.approx(1e-3 * LENGTH**3 / (3 * EI), rel=1e-9)
    assert tip[1] == pytest.approx(LENGTH**2 / (2 * EI), rel=1e-9)  # and turns it
    ratio = rom.modes(1).damping_ratio[0]
    assert ratio == pytest.approx(0.01, rel=1e-9)
    with (home / "out" / "beam_dofs.csv").open() as stream:
        names = [(row["node"], row["direction"]) for row in csv.DictReader(stream)]
    assert len(names) == 60
    # The recovery of a unit motion of the tip is one in the row that the table calls so.
    assert rom.recovery[names.index(("31", "z")), 0] == 1.0
    assert rom.recovery[names.index(("31", "roty")), 1] == 1.0


@pytest.mark.parametrize("stored", [True, False])
def test_the_reduced_matrices_are_solved_by_the_names_of_their_boundary(
    home: Path, capfd: pytest.CaptureFixture[str], stored: bool
) -> None:
    if stored:
        assert stickslip("reduce", "beam.toml", "--out", "out") == 0
    (home / "solve.toml").write_text(STORED if stored else CASE + WHAT_TO_SOLVE)
    capfd.readouterr()
    assert stickslip("solve", "solve.toml", "--out", "solved", "--json") == 0
    (curve,) = json.loads(capfd.readouterr().out)["curves"]
    # The peak lies a factor sqrt(1 - 2 zeta^2) below the frequency, between points 0.01 Hz apart.
    assert curve["peak_frequency_hz"] == pytest.approx(EXACT[0], abs=0.015)
    # 4 / (rho A L) is the tip's share of the first mode; others add their static part, a few per cent of 1 / (2 zeta).
    modal = 1e-3 * 4 / (RHO_A * 1e3 * LENGTH * 1e-3 * (2 * np.pi * EXACT[0]) ** 2 * 2 * 0.01)
    assert curve["peak_amplitude"] == pytest.approx(1e6 * modal, rel=2e-3)  # in um


def test_a_node_is_named_by_its_number_in_the_files(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    peaks = []
    for place in ('at = "tip"', "node = 31"):
        (home / "solve.toml").write_text(CASE + WHAT_TO_SOLVE.replace('at = "tip"', place))
        assert stickslip("solve", "solve.toml", "--out", "solved", "--json") == 0
        (curve,) = json.loads(capfd.readouterr().out)["curves"]
        peaks.append((curve["peak_frequency_hz"], curve["peak_amplitude"]))
    assert peaks[1] == peaks[0]
    (home / "solve.toml").write_text(CASE + WHAT_TO_SOLVE.replace('at = "tip"', "node = 30"))
    assert stickslip("solve", "solve.toml", "--out", "solved") == 2
    assert "node = 30 is not a node of the structure: it has nodes 16 to 31" in capfd.readouterr().err


@pytest.mark.parametrize("seed", range(4))  # rigid motions get a stiffness of either sign
def test_rigid_motions_are_found_behind_the_round_off_of_written_digits(
    home: Path, capfd: pytest.CaptureFixture[str], seed: int
) -> None:
    # DMIG cards and HBMAT write ten digits or more.
    scatter = 1 + 5e-11 * np.random.default_rng(seed).uniform(-1, 1, (62, 62))
    stiffness = scipy.io.mmread(home / "k.mtx").toarray() * (scatter + scatter.T) / 2
    scipy.io.mmwrite(home / "k.mtx", sp.coo_array(stiffness), precision=17, symmetry="symmetric")
    free = CASE.replace("[[structure.support]]\nnodes = [1]\n", "").replace('directions = ["z", "roty"]\n', "")
    (home / "beam.toml").write_text(free.replace("nodes = [31]", "nodes = [31, 1]"))
    assert stickslip("reduce", "beam.toml", "--out", "out", "--json") == 0
    document = json.loads(capfd.readouterr().out)
    assert document["frequency_hz"][:2] == document["rom_frequency_hz"][:2] == [0.0, 0.0]
    assert load_rom(home / "out" / "beam_rom.h5").modes(3).damping_ratio[2] == pytest.approx(0.01, rel=1e-6)


def test_a_free_beam_keeps_its_rigid_motions(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    free = CASE.replace("[[structure.support]]\nnodes = [1]\n", "").replace('directions = ["z", "roty"]\n', "")
    (home / "beam.toml").write_text(free.replace("nodes = [31]", "nodes = [31, 1]"))
    assert stickslip("reduce", "beam.toml", "--out", "out", "--json") == 0
    document = json.loads(capfd.readouterr().out)
    assert document["frequency_hz"][:2] == document["rom_frequency_hz"][:2] == [0.0, 0.0]
    exact = (4.730040744862704 / LENGTH) ** 2 * np.sqrt(EI / RHO_A) / (2 * np.pi)
    assert document["frequency_hz"][2] == pytest.approx(exact, rel=1e-5)
    np.testing.assert_allclose(document["rom_frequency_hz"][:6], document["frequency_hz"][:6], rtol=1e-3)


@pytest.mark.parametrize(("modes", "kept"), [(57, 57), (58, 57), (2000, 57)])
def test_modes_beyond_the_interior_are_said_not_to_be_there(
    home: Path, capfd: pytest.CaptureFixture[str], modes: int, kept: int
) -> None:
    # 60 free degrees of freedom, three of which are kept themselves.
    (home / "beam.toml").write_text(CASE.replace("modes = 12", f"modes = {modes}"))
    assert stickslip("reduce", "beam.toml", "--out", "out") == 0
    said = capfd.readouterr().out
    sentence = f"all {kept} fixed-interface modes of the interior are kept: there are no more, although modes = {modes}"
    assert (sentence in said) == (modes > kept)
    assert "estimated truncation error" in said
    assert "The error is only that of the omitted modes" in said


def test_a_second_run_finds_everything_kept(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert stickslip("reduce", "beam.toml", "--out", "out") == 0

    def fail(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr("study.reduce.comparison.craig_bampton", fail)
    monkeypatch.setattr("study.kind.matrices.reduce.read_matrices", fail)
    assert stickslip("reduce", "beam.toml", "--out", "again") == 0
    assert (home / "again" / "beam_rom.h5").exists()
    # A check takes the kept reduction, and is kept itself.
    assert stickslip("reduce", "beam.toml", "--out", "again", "--check") == 0
    monkeypatch.setattr("study.kind.matrices.reduce.check_fixed_interface_modes", fail)
    assert stickslip("reduce", "beam.toml", "--out", "again", "--check") == 0


Change = Callable[[str], str]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'mass = "m.mtx"',
            'mass = "no.mtx"',
            'beam.toml:6: structure.files.mass = "no.mtx": there is no such file: check its name and folder',
        ),
        ('mass = "m.mtx"', 'mass = "dofs.csv"', 'mass = "dofs.csv": ends in ".csv": give a matrix as one of'),
        ('mass = "m.mtx"', 'mass = "odd.mtx"', 'mass = "odd.mtx": holds a matrix of 2 x 3: it must be square'),
        ('mass = "m.mtx"', 'mass = "small.mtx"', 'mass = "small.mtx": the mass has 2 rows, but'),
        (
            '"dofs.csv"',
            '"few.csv"',
            'structure.files.dofs = "few.csv": lists 1 degrees of freedom, but the matrices have 62 rows: w',
        ),
        (
            '"dofs.csv"',
            '"bad.csv"',
            'structure.files.dofs = "bad.csv": line 2: cannot read "0, 1, u": "u" is not a direction',
        ),
        (
            "nodes = [16]",
            "nodes = [99]",
            "structure.boundary[1].nodes = [99]: node 99 has no degree of freedom x, y, z: no row belongs to it",
        ),
        ("nodes = [16]", "nodes = [1]", 'structure.boundary[1].nodes = [1]: "middle" keeps node 1 z, which a support'),
        ('name = "middle"', 'name = "tip"', 'structure.boundary[1].name = "tip": "tip" is used twice'),
        ("nodes = [16]", "nodes = [2147483648]", "structure.boundary[1].nodes"),
        ("nodes = [16]", f"nodes = [{10**30}]", "structure.boundary[1].nodes"),
        ("nodes = [16]", f"nodes = [{'9' * 5000}]", "beam.toml: it has a number with thousands of digits"),
        ("nodes = [16]", "nodes = [16, 16]", "16 appears twice"),
        ('"mm, tonne, s"', '"mm, kg, s"', "units"),
        (
            '[[structure.boundary]]\nname = "middle"\nnodes = [16]\n',
            "",
            "can still move as a rigid body while the boundary is f",
        ),
        ('kind = "matrices"', 'kind = "matrix"', 'beam.toml:4: structure.kind = "matrix": must be '),
        ('kind = "matrices"', 'kind = "matrix"', 'did you mean "matrices"'),
        ('mass = "m.mtx"', 'mass = "m.mtx"\nmass_name = "M"', 'holds one matrix without a name: remove the name "M"'),
        ("modes = 12", "modes = -1", "structure.reduction.modes"),
    ],
)
def test_mistakes_are_told_with_file_and_key(
    home: Path, capfd: pytest.CaptureFixture[str], old: str, new: str, said: str
) -> None:
    text = CASE.replace('name = "tip"\nnodes = [31]\ndirections = ["z", "roty"]', 'name = "tip"\nnodes = [31]')
    text = text.replace(old, new)
    (home / "beam.toml").write_text(
        text if "middle" in text else text.replace("[[structure.support]]\nnodes = [1]\n", "")
    )
    assert stickslip("reduce", "beam.toml", "--out", "out") == 2
    assert said in capfd.readouterr().err


def test_two_dampings_are_refused(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "beam.toml").write_text(CASE.replace("dofs =", 'damping = "m.mtx"\ndofs ='))
    assert stickslip("reduce", "beam.toml", "--out", "out") == 2
    assert "ratio = 0.01 is given, but the files already contain a damping matrix" in capfd.readouterr().err


def test_solving_needs_a_sweep(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert stickslip("solve", "beam.toml", "--out", "out") == 2
    assert "there is no [sweep]" in capfd.readouterr().err


def write_small(folder: Path, mass: np.ndarray, stiffness: np.ndarray, rest: str) -> None:
    for name, matrix in (("m", mass), ("k", stiffness)):
        scipy.io.mmwrite(folder / f"{name}.mtx", sp.coo_array(matrix), precision=17, symmetry="symmetric")
    files = '[structure.files]\nmass = "m.mtx"\nstiffness = "k.mtx"\n'
    (folder / "small.toml").write_text(f'schema = 2\n[structure]\nkind = "matrices"\n{files}{rest}')


KEPT_0 = '[[structure.boundary]]\nname = "first"\nnodes = [0]\n'


def test_a_soft_mode_of_a_held_structure_is_no_rigid_motion(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    write_small(home, np.eye(3), np.diag([1.0, 1e10, 1e10]), f'{KEPT_0}[structure.damping]\nratio = "1 %"\n')
    assert stickslip("reduce", "small.toml", "--out", "out", "--json") == 0
    document = json.loads(capfd.readouterr().out)
    want = np.array([1.0, 1e5, 1e5]) / (2 * np.pi)
    # A dense solve errs by round-off times the largest eigenvalue: 1e-6 of the first.
    np.testing.assert_allclose(document["frequency_hz"], want, rtol=1e-5)
    np.testing.assert_allclose(document["rom_frequency_hz"], want, rtol=1e-5)
    assert load_rom(home / "out" / "small_rom.h5").modes(1).damping_ratio[0] == pytest.approx(0.01, rel=1e-5)


def test_a_soft_mode_beside_a_rigid_motion_keeps_its_frequency_and_takes_the_damping(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    # Two masses on a soft spring float freely; a third one stands on a hard one.
    stiffness = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1e10]])
    write_small(home, np.eye(3), stiffness, f'{KEPT_0}[structure.damping]\nratio = "1 %"\n')
    assert stickslip("reduce", "small.toml", "--out", "out", "--json") == 0
    document = json.loads(capfd.readouterr().out)
    want = np.sqrt([0.0, 2.0, 1e10]) / (2 * np.pi)
    np.testing.assert_allclose(document["frequency_hz"], want, rtol=1e-4)  # behind a shift of 0.1
    np.testing.assert_allclose(document["rom_frequency_hz"], want, rtol=1e-5)
    rom = load_rom(home / "out" / "small_rom.h5").modes(2)
    assert rom.damping_ratio[1] == pytest.approx(0.01, rel=1e-5)


CHAIN = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
BUCKLED = np.array([[1.0, 2.0], [2.0, 1.0]])


@pytest.mark.parametrize(
    ("mass", "stiffness", "said"),
    [
        (np.diag([0.0, 1.0, 1.0]), CHAIN, "node 0 x has no mass: write a consistent mass matrix"),
        (np.eye(2), BUCKLED, "structure.files.stiffness"),
        (BUCKLED, np.eye(2), "structure.files.mass"),
        # Within the digits of single precision, but too much for the eigenvalues.
        (np.eye(2), np.array([[1.0, -1.0 - 1e-7], [-1.0 - 1e-7, 1.0]]), "write them with more digits"),
    ],
)
def test_matrices_without_real_modes_are_refused(
    home: Path, capfd: pytest.CaptureFixture[str], mass: np.ndarray, stiffness: np.ndarray, said: str
) -> None:
    write_small(home, mass, stiffness, KEPT_0)
    assert stickslip("reduce", "small.toml", "--out", "out") == 2
    assert said in capfd.readouterr().err
