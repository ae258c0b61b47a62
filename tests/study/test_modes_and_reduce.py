"""`stickslip modes` and `stickslip reduce` as a user runs them: files that hold what the numerical packages compute."""

import json
import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX20
from fe.file.mesh_file import read_mesh, write_mesh
from fe.mac import modal_assurance_criterion
from fe.material import Material
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.modal import ModeSet, modes
from geometry.errors import InputError
from reduction.errors import RomError
from reduction.file.rom_hdf5 import load_rom
from study import cli

Command = Callable[..., "subprocess.CompletedProcess[str]"]
ALUMINIUM = Material(young=70e9, poisson=0.33, density=2700.0)
ALLOY = ["--young", "70 GPa", "--poisson", "0.33", "--density", "2.7 g/cm^3"]


def tapered_bar() -> Mesh:
    """A bar of unequal sides in metres: no two of its first modes are close."""

    def shape(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        taper = 1 - 0.4 * w
        return 0.03 * (u - 0.5) * taper, 0.01 * (v - 0.5) * taper, 0.2 * w

    faces = {"w0": "CLAMP", "w1": "TIP"}
    mesh = mesh_blocks([Block(shape=shape, counts=(2, 1, 8), faces=faces)], HEX20)
    return replace(mesh, node_sets={"TIP_NODE": mesh.nodes("TIP")[:1]})


def held(mesh: Mesh) -> tuple[ModeSet, np.ndarray]:
    """First modes of the bar, clamped at its foot, and their shapes on the mesh (node, direction, mode)."""
    system = supported_system(mesh, *assemble(mesh, ALUMINIUM), [Support(nodes=mesh.nodes("CLAMP"))])
    result = modes(system, 4)
    return result, system.on_mesh(result.mode_shapes)


@pytest.mark.draws
def test_modes_of_an_own_mesh_are_those_of_the_api_and_all_are_in_one_file(tmp_path: Path, stickslip: Command) -> None:
    mesh = tapered_bar()
    in_millimetres = Mesh(points=1e3 * mesh.points, cells=mesh.cells, face_sets=mesh.face_sets)
    write_mesh(in_millimetres, tmp_path / "part.inp")
    words = ["modes", "part.inp", "--length-unit", "mm", "--fix", "CLAMP", "--n-modes", "4", *ALLOY, "--film", "2"]
    done = stickslip(tmp_path, *words, "--out", "out", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    result, shapes = held(mesh)
    # The deck has 13 digits of coordinates, in millimetres; a slender bar's first mode loses three more.
    np.testing.assert_allclose(document["frequency_hz"], result.frequency, rtol=1e-8)
    assert document["n_dof"] == shapes.shape[0] * 3 - 3 * len(mesh.nodes("CLAMP"))

    files = {Path(file).name for file in document["files"]}
    assert files == {file.name for file in (tmp_path / "out").iterdir()}
    assert files == {
        *(f"part_mode{number}.png" for number in range(1, 5)),
        "part_mode1_stress.png",
        "part_modes.html",
        "part_mode2.gif",
        "part_modes.vtu",
    }
    read = meshio.read(tmp_path / "out" / "part_modes.vtu")
    fields = {name: values for name, values in read.point_data.items() if name.startswith("mode ")}
    assert len(fields) == 4
    for number, frequency in enumerate(result.frequency):
        (name,) = (name for name in fields if name.startswith(f"mode {number + 1}: "))
        assert float(re.findall(r": (\S+) Hz", name)[0]) == pytest.approx(frequency, rel=1e-5)  # six digits shown
        alike = modal_assurance_criterion(shapes[:, :, [number]].reshape(-1, 1), fields[name].reshape(-1, 1))
        assert alike[0, 0] == pytest.approx(1, abs=1e-9)
    # The file is a mesh again, in metres, with its sets.
    again = read_mesh(tmp_path / "out" / "part_modes.vtu")
    np.testing.assert_allclose(np.ptp(again.points, axis=0), [0.03, 0.01, 0.2], rtol=1e-12)
    assert {*again.face_sets} == {"CLAMP", "TIP"}


@pytest.mark.draws
def test_a_free_mesh_has_six_zeros_and_its_first_elastic_mode_is_the_one_that_moves(
    tmp_path: Path, stickslip: Command
) -> None:
    write_mesh(tapered_bar(), tmp_path / "part.vtu")
    words = ["modes", "part.vtu", "--length-unit", "m", "--free", "--n-modes", "7", *ALLOY, "--out", "out", "--json"]
    done = stickslip(tmp_path, *words)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["frequency_hz"][:6] == [0.0] * 6
    assert document["frequency_hz"][6] > 100
    names = {Path(file).name for file in document["files"]}
    assert {"part_mode7.gif", "part_mode7_stress.png"} <= names


@pytest.fixture(scope="module")
def reduced(
    tmp_path_factory: pytest.TempPathFactory, case_text: dict[str, str], stickslip: Command
) -> tuple[Path, dict[str, object]]:
    """The command's folder and its document, for the rig's blade with one element through the thickness."""
    folder = tmp_path_factory.mktemp("reduce")
    text = case_text["blade"].replace("elements_through_thickness = 2", "elements_through_thickness = 1")
    (folder / "my.toml").write_text(text.replace("modes = 150", "modes = 40"))
    done = stickslip(folder, "reduce", "my.toml", "--out", "out", "--json", "--check")
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


def test_reduce_writes_solid_mesh_model_and_response(reduced: tuple[Path, dict[str, object]]) -> None:
    folder, document = reduced
    files = {Path(str(file)).name for file in document["files"]}  # type: ignore[attr-defined]
    assert files == {"my.step", "my.vtu", "my_rom.h5", "my_response.png", "my_reduce.html"}
    assert {file.name for file in (folder / "out").iterdir()} == files
    check = document["mode_check"]
    assert check["n_below"] == check["n_found"] > 30  # type: ignore[index]
    assert check["largest_residual"] < 1e-8  # type: ignore[index]
    assert (folder / "out" / "my.step").read_text().startswith("ISO-10303-21")
    assert (folder / "out" / "my_response.png").read_bytes().startswith(b"\x89PNG")
    mesh = read_mesh(folder / "out" / "my.vtu")
    assert {"excitation", "response", "contact_positive", "contact_negative"} <= {*mesh.node_sets}


def test_the_file_of_the_reduced_model_reproduces_the_frequencies_and_says_where_it_comes_from(
    reduced: tuple[Path, dict[str, object]],
) -> None:
    folder, document = reduced
    rom = load_rom(folder / "out" / "my_rom.h5")
    frequency = rom.modes(10).frequency
    # Nothing is lost in the file; the dense solver's round-off may differ between processes.
    np.testing.assert_allclose(frequency, document["rom_frequency_hz"], rtol=1e-9)  # type: ignore[call-overload]
    full = np.array(document["frequency_hz"])
    assert frequency[0] == pytest.approx(full[0], rel=1e-6)
    assert (frequency >= full * (1 - 1e-8)).all()
    # The peak is below the natural frequency by zeta^2, 4e-6, and right to 1e-5.
    assert document["hb_peak_hz"] == pytest.approx(frequency[0], rel=1.5e-5)
    # Two points and two lines of seven stations in three directions, and 40 modes.
    assert document["n_reduced"] == rom.n_dof == 3 * (2 + 14) + 40
    assert rom.provenance["title"] == "Rig's blade"
    assert "stickslip" in rom.provenance


def test_a_reduced_model_of_another_version_or_cut_short_is_refused_by_name(
    reduced: tuple[Path, dict[str, object]], tmp_path: Path
) -> None:
    import h5py

    whole = (reduced[0] / "out" / "my_rom.h5").read_bytes()
    short, other = tmp_path / "short.h5", tmp_path / "other.h5"
    short.write_bytes(whole[: len(whole) // 2])
    other.write_bytes(whole)
    with h5py.File(other, "r+") as file:
        file.attrs["format_version"] = 2
    with pytest.raises(
        RomError, match=r"short\.h5.*is truncated, damaged or not an HDF5 file: reduce the system again"
    ):
        load_rom(short)
    with pytest.raises(RomError, match=r"other\.h5.*has format version 2, but .* reads version 1: reduce .* again"):
        load_rom(other)
    assert issubclass(RomError, InputError)  # which the command line answers with exit code 2


#: Two masses on springs with proportional damping, and a contact between the second and the ground.
PLAIN = """\
schema = 2
[structure]
kind = "plain"
file = "chain.npz"
[[joint]]
kind = "friction"
name = "pad"
tangent = { dof = 1 }
normal = { dof = 0 }
normal_stiffness = "1 N/um"
tangential_stiffness = "1 N/um"
friction_coefficient = 0.5
preload = "20 N"
"""


def test_modes_of_plain_matrices_are_a_table(at_home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    k, beta = 1e6, 2e-6
    stiffness = k * np.array([[2.0, -1.0], [-1.0, 2.0]])
    np.savez(at_home / "chain.npz", M=np.eye(2), K=stiffness, C=beta * stiffness)
    (at_home / "chain.toml").write_text(PLAIN, encoding="utf-8")
    assert cli.main(["modes", "chain.toml", "--out", "out", "--json"]) == 0
    document = json.loads(capfd.readouterr().out)
    # Two masses on three equal springs: k and 3 k; damping ratios are beta omega / 2.
    omega = np.sqrt([k, 3 * k])
    np.testing.assert_allclose(document["frequency_hz"], omega / (2 * np.pi), rtol=1e-12)
    np.testing.assert_allclose(document["damping_ratio"], beta * omega / 2, rtol=1e-12)
    # With the contact stuck both diagonals are 3 k.
    stuck = np.sqrt([2 * k, 4 * k])
    np.testing.assert_allclose(document["stuck_frequency_hz"], stuck / (2 * np.pi), rtol=1e-12)
    (file,) = document["files"]
    head, first, *_ = Path(file).read_text(encoding="utf-8").splitlines()
    assert head == "mode,frequency_hz,damping_ratio,stuck_frequency_hz,stuck_damping_ratio"
    assert float(first.split(",")[1]) == pytest.approx(omega[0] / (2 * np.pi), rel=1e-9)  # ten digits are written


def test_a_structure_that_nothing_holds_has_a_mode_at_zero_without_a_damping_ratio(
    at_home: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stiffness = 1e6 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    np.savez(at_home / "chain.npz", M=np.eye(2), K=stiffness, C=1e-6 * stiffness)
    (at_home / "chain.toml").write_text(PLAIN.partition("[[joint]]")[0], encoding="utf-8")
    assert cli.main(["modes", "chain.toml", "--out", "out", "--n-modes", "9", "--json"]) == 0
    document = json.loads(capfd.readouterr().out)
    assert document["frequency_hz"] == [0.0, pytest.approx(np.sqrt(2e6) / (2 * np.pi), rel=1e-12)]
    assert document["damping_ratio"] == [None, pytest.approx(1e-6 * np.sqrt(2e6) / 2, rel=1e-12)]
    assert "stuck_frequency_hz" not in document
    assert cli.main(["modes", "chain.toml", "--out", "out", "--film", "1"]) == 2
    assert "--film 1: plain matrices have no mesh" in capfd.readouterr().err
