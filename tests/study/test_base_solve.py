"""`stickslip solve` on a shaken base and with a loss factor: every kind of case beside closed forms and full meshes."""

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import sparse
from scipy.io import mmwrite

from casefile.errors import CaseError
from fe.assembly import assemble
from fe.element import HEX20
from fe.file.mesh_file import write_mesh
from fe.material import STEEL
from fe.mesher.block import Block, mesh_blocks
from study import cli
from study.case.setup import read_case

MASS = np.diag([2.0, 1.0])
SPRING, DASHPOT = (4e4, 1e4), (30.0, 8.0)
STIFFNESS, DAMPING = (np.array([[a + b, -b], [-b, b]]) for a, b in (SPRING, DASHPOT))
CHAIN = """\
schema = 2
[structure]
kind = "plain"
file = "chain.npz"
[[structure.dof]]
direction = "z"
node = 0
[[structure.dof]]
direction = "z"
node = 1
[[load]]
base = "z"
displacement = "0.1 mm"
[[sensor]]
name = "laser"
dof = 1
[[sensor]]
name = "gauge"
dof = 1
relative = true
[harmonics]
highest = 3
[sweep]
from = "10 Hz"
to = "30 Hz"
levels = [1, 3]
"""
#: Of a part and of its matrices: a cantilever of 100 mm.
PART = """\
schema = 2
[structure]
kind = "part"
file = "bar.vtu"
length_unit = "m"
[structure.material]
young = "210 GPa"
poisson = 0.3
density = "7800 kg/m^3"
[structure.damping]
loss_factor = "2 %"
[structure.reduction]
modes = 30
[[structure.support]]
on = ["clamp"]
[[structure.boundary]]
name = "end"
on = "end"
[[load]]
base = "z"
acceleration = "3 m/s^2"
[[sensor]]
name = "end"
at = "end"
direction = "z"
[harmonics]
highest = 1
[sweep]
from = "600 Hz"
to = "1000 Hz"
"""


@pytest.fixture
def home(at_home: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    # Drawing takes longer than these curves.
    monkeypatch.setattr("study.solve.run._list_results", lambda *_: {})
    np.savez(at_home / "chain.npz", M=MASS, C=DAMPING, K=STIFFNESS)
    return at_home


@pytest.fixture
def solved(home: Path, capfd: pytest.CaptureFixture[str]) -> Callable[[str], tuple[dict, xr.Dataset]]:
    def solve(case: str) -> tuple[dict, xr.Dataset]:
        (home / "my.toml").write_text(case)
        assert cli.main(["solve", "my.toml", "--out", "out", "--json"]) == 0
        with xr.open_dataset(home / "out" / "my_response.nc", engine="h5netcdf") as data:
            return json.loads(capfd.readouterr().out), data.load()

    return solve


def transmissibility(omega: np.ndarray) -> np.ndarray:
    """Absolute motion of the upper mass over that of the base."""
    push = [np.array([SPRING[0] + 1j * w * DASHPOT[0], 0.0]) for w in omega]
    dynamic = [STIFFNESS - w**2 * MASS + 1j * w * DAMPING for w in omega]
    return np.array([np.linalg.solve(a, b)[1] for a, b in zip(dynamic, push, strict=True)])


def outputs(data: xr.Dataset, harmonic: int) -> np.ndarray:
    return (data["output_real"] + 1j * data["output_imag"]).values[:, harmonic]


def test_a_held_displacement_gives_absolute_and_relative_motion(
    home: Path, solved: Callable[[str], tuple[dict, xr.Dataset]]
) -> None:
    document, data = solved(CHAIN)
    assert document["motion"] == {"laser": "absolute", "gauge": "relative"}
    assert data["output_motion"].values.tolist() == ["absolute", "relative"]
    omega, base = 2 * np.pi * data["frequency"].values, 1e-4 * data["level"].values
    assert set(np.round(data["level"].values, 12)) == {1.0, 3.0}
    result = outputs(data, 1)
    # Newton's method stops at 1e-9 of the motion.
    np.testing.assert_allclose(result[:, 0], transmissibility(omega) * base, rtol=1e-7)
    np.testing.assert_allclose(result[:, 1], (transmissibility(omega) - 1) * base, rtol=1e-7)
    with (home / "out" / "my_response.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert float(rows[0]["laser absolute amplitude [um]"]) == pytest.approx(1e6 * abs(result[0, 0]), rel=1e-8)
    assert float(rows[0]["gauge relative amplitude [um]"]) == pytest.approx(1e6 * abs(result[0, 1]), rel=1e-8)


def test_a_curve_over_the_level_of_a_held_velocity_is_a_straight_line(
    solved: Callable[[str], tuple[dict, xr.Dataset]],
) -> None:
    sweep = 'parameter = "level"\nfrom = 1\nto = 4\nfrequencies = ["17 Hz"]\n'
    case = CHAIN.replace('displacement = "0.1 mm"', 'velocity = "5 mm/s"')
    _, data = solved(case[: case.index('from = "10 Hz"')] + sweep)
    omega = 2 * np.pi * 17
    expected = transmissibility(np.array([omega]))[0] * 5e-3 * data["level"].values / (1j * omega)
    assert data["level"].values[[0, -1]] == pytest.approx([1, 4])
    np.testing.assert_allclose(outputs(data, 1)[:, 0], expected, rtol=1e-7)


def test_harmonics_and_phases_of_a_base_superpose(solved: Callable[[str], tuple[dict, xr.Dataset]]) -> None:
    second = '[[load]]\nbase = "z"\ndisplacement = "40 um"\nharmonic = 2\nphase = "-60 deg"\n[[sensor]]'
    _, data = solved(CHAIN.replace("[[sensor]]", second, 1))
    omega = 2 * np.pi * data["frequency"].values
    for k, base in ((1, 1e-4), (2, 4e-5 * np.exp(-1j * np.pi / 3))):
        expected = transmissibility(k * omega) * base * data["level"].values
        np.testing.assert_allclose(outputs(data, k)[:, 0], expected, rtol=1e-7)


def test_a_part_with_a_loss_factor_moves_as_its_full_mesh(
    home: Path, solved: Callable[[str], tuple[dict, xr.Dataset]]
) -> None:
    """The supports of the whole mesh are moved; its stiffness is complex."""
    mesh = mesh_blocks([Block.box(((0, 0.1), (0, 0.01), (0, 0.01)), (5, 1, 1), {"u0": "clamp", "u1": "end"})], HEX20)
    write_mesh(mesh, home / "bar.vtu")
    _, data = solved(PART)
    mass, stiffness = (matrix.toarray() for matrix in assemble(mesh, STEEL))
    held = np.unique(3 * mesh.nodes("clamp")[:, None] + np.arange(3))
    free, end = np.setdiff1d(np.arange(len(mass)), held), 3 * mesh.nodes("end") + 2
    motion = np.zeros(len(mass))
    motion[2::3] = 1.0
    for point in (0, 20, len(data["frequency"]) - 1):
        omega = 2 * np.pi * float(data["frequency"][point])
        base, Z = -3.0 / omega**2, (1 + 0.02j) * stiffness - omega**2 * mass
        moved = np.zeros(len(mass), dtype=complex)
        moved[free] = np.linalg.solve(Z[np.ix_(free, free)], -Z[np.ix_(free, held)] @ motion[held]) * base
        # Thirty fixed-interface modes leave 1e-4 of the motion at the first resonance.
        assert outputs(data, 1)[point, 0] == pytest.approx(moved[end].mean(), rel=1e-3)


def test_imported_matrices_move_as_unreduced_ones_with_prescribed_supports(home: Path) -> None:
    n = 6
    mass, k = np.diag(np.linspace(1, 2, n)), 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    k[-1, -1] = 1e6
    mmwrite(home / "m.mtx", sparse.coo_array(mass))
    mmwrite(home / "k.mtx", sparse.coo_array(k))
    case = """\
schema = 2
[structure]
kind = "matrices"
[structure.files]
mass = "m.mtx"
stiffness = "k.mtx"
[structure.reduction]
modes = 10
[[structure.support]]
nodes = [0]
[[structure.boundary]]
name = "tip"
nodes = [5]
[[load]]
base = "x"
[[sensor]]
name = "tip"
at = "tip"
direction = "x"
"""
    (home / "my.toml").write_text(case)
    model = read_case(home / "my.toml").model
    omega = 500.0
    free, held = np.arange(1, n), [0]
    full = k - omega**2 * mass
    expected = np.linalg.solve(full[np.ix_(free, free)], -full[np.ix_(free, held)] @ [-1 / omega**2])
    system, row = model.system, model.sensors[0].row
    relative = np.linalg.solve(system.stiffness - omega**2 * system.mass, system.dynamic[1])
    assert model.base_acceleration is not None
    absolute = row @ relative - row @ model.base_acceleration[1] / omega**2
    # All modes are retained: round-off.
    assert absolute == pytest.approx(expected[-1], rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (("[[sensor]]", '[[load]]\ndof = 0\n[[sensor]]'), r"load\[0\].*the ratio of the loads would change with freq"),
        (('displacement = "0.1 mm"', 'displacement = "0.1 mm"\namplitude = "1 N"'), r"amplitude is that of a force"),
        (('displacement = "0.1 mm"', 'displacement = "3 N"'), r"displacement.*length"),
        (('base = "z"\n', 'base = "x"\n'), r"no degree of freedom moves along x"),
    ],
)  # fmt: skip
def test_what_no_base_can_do_is_one_sentence(home: Path, changes: tuple[str, str], says: str) -> None:
    (home / "my.toml").write_text(CHAIN.replace(*changes, 1))
    with pytest.raises(CaseError, match=says):
        read_case(home / "my.toml")


def test_a_part_that_nothing_holds_has_no_base(home: Path) -> None:
    mesh = mesh_blocks([Block.box(((0, 0.1), (0, 0.01), (0, 0.01)), (3, 1, 1), {"u0": "clamp", "u1": "end"})], HEX20)
    write_mesh(mesh, home / "bar.vtu")
    (home / "my.toml").write_text(PART.replace('[[structure.support]]\non = ["clamp"]\n', ""))
    with pytest.raises(CaseError, match=r"no \[\[structure.support\]\] fixes the part"):
        read_case(home / "my.toml")


def test_limits_of_a_held_displacement_are_refused_before_the_search(
    home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    slip = (
        '[[joint]]\nkind = "jenkins"\nname = "slip"\ndof = 0\ntangential_stiffness = "20 N/mm"\nlimit_force = "3 N"\n'
    )
    (home / "my.toml").write_text(CHAIN + slip)
    assert cli.main(["limits", "my.toml", "--out", "out", "--quiet"]) != 0
    assert "give the acceleration of the base instead of its velocity or displacement" in capfd.readouterr().err
