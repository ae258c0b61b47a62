"""`stickslip new`: every kind writes a case that loads, and that other commands take as it is."""

import io
import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fe.element import HEX20
from fe.file.mesh_file import write_mesh
from fe.mesher.mesh_rule import MeshRule
from fe.mesher.plain_blade import mesh_plain_blade
from geometry.plain_blade import PlainBlade
from study import cli
from study.case.setup import read_case
from study.kind.registry import CASE_KINDS, open_case
from study.new.write import DRAFTERS

CHAIN = 1e6 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
#: The highest point of a curve is at the natural frequency within half a step, BAND / 100 of it.
HALF_STEP = 1e-3


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def new(*words: str) -> int:
    return cli.main(["new", *words, "--quiet"])


def write_bar(file: str) -> None:
    """A bar of a few elements with named faces, in metres."""
    rule = MeshRule(element=HEX20, through_thickness=1, length_ratio=2.4, length_cap=0.02)
    write_mesh(mesh_plain_blade(PlainBlade(), rule), file)


def test_every_kind_of_the_product_has_a_draft() -> None:
    assert set(DRAFTERS) == {
        name for name in CASE_KINDS.names() if CASE_KINDS[name].table.__module__.startswith("study.")
    }


def test_the_case_of_plain_matrices_is_driven_through_its_first_resonance(here: Path) -> None:
    np.savez("chain.npz", M=np.eye(4), K=CHAIN)
    assert new("plain", "chain.npz") == 0
    first = np.sqrt(np.linalg.eigvalsh(CHAIN)[0]) / (2 * np.pi)
    sweep = read_case("chain.toml").setup
    assert sweep.model.system.n_dof == 4
    assert cli.main(["solve", "chain.toml", "--out", "solved", "--quiet"]) == 0
    with xr.open_dataset("solved/chain_response.nc", engine="h5netcdf") as data:
        amplitude = np.hypot(data.output_real, data.output_imag).isel(output=0).sel(harmonic=1)
        assert float(data.frequency[int(np.argmax(amplitude.data))]) == pytest.approx(first, rel=HALF_STEP)


def test_the_place_that_a_campaign_assumes_is_in_the_case(here: Path) -> None:
    np.savez("chain.npz", M=np.eye(4), K=CHAIN)
    assert new("plain", "chain.npz") == 0
    model = read_case("chain.toml").setup.model
    assert model.places["tip"] == pytest.approx(model.sensors[0].row)


def test_the_joint_of_the_comments_is_one_that_the_case_takes(here: Path) -> None:
    np.savez("chain.npz", M=np.eye(4), K=CHAIN)
    new("plain", "chain.npz")
    text = Path("chain.toml").read_text()
    start = text.index("# [[joint]]")
    stop = text.index("\n\n", start)
    with_joint = text[:start] + text[start:stop].replace("# ", "") + text[stop:]
    Path("chain.toml").write_text(with_joint)
    (joint,) = read_case("chain.toml").setup.model.system.joints
    assert joint.kind == "jenkins"


def test_a_structure_that_cannot_be_made_leaves_what_was_there(here: Path) -> None:
    np.savez("loose.npz", M=np.eye(4), K=np.zeros((4, 4)))
    assert new("plain", "loose.npz") == 2
    assert not Path("loose.toml").exists()
    Path("loose.toml").write_text("mine")
    assert new("plain", "loose.npz", "--force") == 2
    assert Path("loose.toml").read_text() == "mine"


def test_a_rigid_motion_is_not_taken_for_the_first_resonance(here: Path) -> None:
    free = CHAIN.copy()
    free[0, 0] = free[3, 3] = 1e6
    np.savez("free.npz", M=np.eye(4), K=free)
    assert cli.main(["new", "plain", "free.npz", "--json"]) == 0
    frequency = np.sqrt(np.linalg.eigvalsh(free)[1]) / (2 * np.pi)
    assert f"{frequency:.5g}" in Path("free.toml").read_text()


def test_a_blade_has_the_dimensions_that_were_given(here: Path, capfd: pytest.CaptureFixture[str]) -> None:
    words = ["--length", "120 mm", "--thickness", "6 mm", "--chord", "15 mm"]
    assert cli.main(["new", "blade", *words, "--json"]) == 0
    blade = open_case("blade.toml").case.structure.blade
    assert (blade.length, blade.thickness, blade.chord) == (0.12, 0.006, 0.015)
    beam = 1.8751**2 / (2 * np.pi) * np.sqrt(210e9 * 0.006**2 / (12 * 7800)) / 0.12**2
    # The root block is compliant: about the thickness over the length, 5 %.
    assert json.loads(capfd.readouterr().out)["frequency_hz"] == pytest.approx(0.96 * beam, rel=0.05)
    assert cli.main(["solve", "blade.toml", "--out", "solved", "--quiet"]) == 0


def test_a_rig_loads(here: Path) -> None:
    assert new("rig") == 0
    assert open_case("rig.toml").kind.name == "rig"


def test_a_mesh_is_fixed_at_its_set_and_driven_far_from_it(here: Path) -> None:
    write_bar("bar.inp")
    assert new("part", "bar.inp", "--length-unit", "m") == 0
    table = open_case("bar.toml").case.structure
    assert table.support[0].on == ("clamp",)
    assert table.point[0].at[2] == pytest.approx(PlainBlade().length)
    assert cli.main(["solve", "bar.toml", "--out", "solved", "--quiet"]) == 0


def test_a_mesh_of_several_materials_gets_one_with_a_word(here: Path) -> None:
    write_bar("bar.inp")
    deck = Path("bar.inp")
    for name in ("SOFT", "HARD"):
        with deck.open("a") as more:
            more.write(f"*MATERIAL, NAME={name}\n*ELASTIC\n{len(name) + ord(name[0])}e9, 0.3\n*DENSITY\n2700.\n")
    assert new("part", "bar.inp", "--length-unit", "m") == 0
    assert 'bar.inp has the materials "SOFT" and "HARD"' in Path("bar.toml").read_text()


def test_a_set_that_is_not_there_is_one_sentence_with_those_that_are(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_bar("bar.inp")
    assert new("part", "bar.inp", "--length-unit", "m", "--fix", "hub") == 2
    said = capsys.readouterr().err
    assert "hub" in said
    assert "clamp" in said
    assert not Path("bar.toml").exists()


def test_matrices_are_supported_and_measured_at_nodes(here: Path) -> None:
    from scipy.io import mmwrite
    from scipy.sparse import csr_array

    mmwrite("mass.mtx", csr_array(np.eye(4)), symmetry="symmetric")
    mmwrite("stiffness.mtx", csr_array(CHAIN), symmetry="symmetric")
    assert new("matrices", "mass.mtx", "stiffness.mtx", "--fix", "0", "--point", "3", "--out", "m.toml") == 0
    assert cli.main(["reduce", "m.toml", "--out", "reduced", "--quiet"]) == 0
    assert cli.main(["solve", "m.toml", "--out", "solved", "--quiet"]) == 0


def test_the_faces_of_a_step_file_are_listed_with_points_on_them(here: Path) -> None:
    from geometry.face_selector import FaceSelector
    from geometry.listed_faces import list_faces
    from geometry.step_part import read_body

    parts = Path(__file__).parents[2] / "examples" / "parts"
    shutil.copy(parts / "screw.step", here)
    body = read_body(here / "screw.step")
    faces = list_faces(body)
    assert sum(face.area for face in faces) == pytest.approx(body.solid.Area() * 1e-6)
    for number, face in enumerate(faces):
        selector = FaceSelector(at=tuple(face.inside))
        # The point is on this face and on no other.
        assert [k for k, known in enumerate(body.faces) if known.fits(selector)] == [number]


def test_a_file_that_is_there_is_not_replaced(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("rig.toml").write_text("mine")
    assert new("rig") == 2
    assert "--force" in capsys.readouterr().err
    assert Path("rig.toml").read_text() == "mine"


@pytest.mark.parametrize(
    ("words", "value"),
    [
        (["part", "nothing.step"], "nothing.step"),
        (["blade", "--length", "long"], "long"),
        (["blade", "--length", "0 mm"], "0 mm"),
        (["plain"], ".npz"),
        ([], "blade"),
    ],
)
def test_bad_input_is_one_sentence(
    here: Path, capsys: pytest.CaptureFixture[str], words: list[str], value: str
) -> None:
    assert new(*words) == 2
    said = capsys.readouterr().err
    assert value in said
    assert said.count("\n") == 1


def test_in_a_terminal_it_asks(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Typed(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr(sys, "stdin", Typed("blade\n90 mm\n4 mm\n\n"))
    assert new() == 0
    assert open_case("blade.toml").case.structure.blade.length == 0.09
    assert "assumed" not in Path("blade.toml").read_text()
