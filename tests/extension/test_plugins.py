"""Members of every kind from files that a case names: one key, and every command and process finds them."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from casefile.errors import CaseError
from diagnosis.effect import EFFECTS
from fe.element import REGISTRY as ELEMENTS
from fe.file.mesh import MESH_FORMATS
from figure.registry import REGISTRY as FIGURES
from geometry.registry import REGISTRIES, loaded_files
from reduction.joint_law.registry import LAWS
from study import cli
from study.case.setup import read_case
from study.kind.registry import CASE_KINDS, open_case
from study.shipped_cases import BLADE
from tests.slow import slow

HERE = Path(__file__).parent
FILES = ("mass_on_wall.py", "iwan.py", "part_modulus.py", "nyquist_figure.py", "wedge15.py", "json_mesh.py")
#: The kind, the joint, the effect and the figure of this case are those of the files.
CASE = f"""\
schema = 2
[plugins]
files = {json.dumps(FILES)}
[structure]
kind = "mass_on_wall"
mass = "1 kg"
stiffness = "1 N/um"
[[joint]]
kind = "iwan"
name = "pad"
place = "along"
stiffness = "0.3 N/um"
limit_force = "1000 N"
[[load]]
place = "along"
[harmonics]
highest = 1
samples = 64
[sweep]
from = "178 Hz"
to = "184 Hz"
step = "3 Hz"
levels = [0.1]
"""


@pytest.fixture
def case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A case beside the files that it names."""
    monkeypatch.setenv("STICKSLIP_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    for name in FILES:
        (tmp_path / name).write_text((HERE / name).read_text(encoding="utf-8"), encoding="utf-8")
    file = tmp_path / "wall.toml"
    file.write_text(CASE, encoding="utf-8")
    yield file
    for name in FILES:
        forget(tmp_path / name)


def forget(file: Path) -> None:
    for registry in REGISTRIES:
        registry.forget(file)


def test_a_case_names_members_of_every_kind(case: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["solve", "wall.toml", "--out", "out", "--json"]) == 0
    (curve,) = json.loads(capfd.readouterr().out)["curves"]
    # Far below its limits the chain is a spring of 0.3 N/um beside one of 1 N/um; points are 3 Hz apart.
    assert curve["peak_frequency_hz"] == pytest.approx(np.sqrt(1.3e6) / (2 * np.pi), abs=3)
    assert (case.parent / "out" / "wall_response_nyquist.png").is_file()
    for registry, name in (
        (CASE_KINDS, "mass_on_wall"), (LAWS, "iwan"), (EFFECTS, "modulus"), (FIGURES, "nyquist"), (ELEMENTS, "wedge15"),
    ):  # fmt: skip
        assert name in registry
    assert "json_mesh.py" in {file.name for file in MESH_FORMATS.outside_files()}
    assert {file.name for file in loaded_files()} >= {*FILES}


@slow
def test_a_reduction_in_another_process_finds_the_element_of_a_case(case: Path, tmp_path: Path) -> None:
    text = BLADE.read_text(encoding="utf-8").replace('"hex20"', '"wedge15"').replace("modes = 150", "modes = 5")
    text = re.sub("elements_through_thickness = .*", "elements_through_thickness = 1", text)
    text = re.sub("length_ratio = .*", "length_ratio = 5", text).replace('"8 mm"', '"20 mm"')
    own = tmp_path / "blade.toml"
    own.write_text(text.replace("[structure]", '[plugins]\nfiles = ["wedge15.py"]\n[structure]', 1), encoding="utf-8")
    assert read_case(own).structure.matrices.rom is not None
    forget(tmp_path / "wedge15.py")
    own.write_text(text, encoding="utf-8")
    with pytest.raises(CaseError, match=r'mesh.element = "wedge15"'):
        open_case(own)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ('files = ["none.py"]', r'plugins.files\[0\] = "none.py": .*no such file.*Python file'),
        ('files = ["empty.py"]', r"registers nothing: .*`register`"),
        ('files = ["broken.py"]', r"broken.py, line 1: ZeroDivisionError: .*: correct the file"),
        ('file = ["iwan.py"]', r'plugins.file: unknown key; did you mean "files"'),
        ('files = "iwan.py"', r"plugins.files = .*must be a list in brackets"),
    ],
)
def test_a_file_that_does_not_do_has_its_line(case: Path, wrong: str, words: str) -> None:
    case.with_name("empty.py").write_text("", encoding="utf-8")
    case.with_name("broken.py").write_text("1 / 0\n", encoding="utf-8")
    case.write_text(re.sub(r"files = .*", wrong, CASE, count=1), encoding="utf-8")
    with pytest.raises(CaseError, match=words) as caught:
        open_case(case)
    (problem,) = caught.value.problems
    assert problem.line == 3


def test_an_effect_beside_a_case_can_be_added_to_it(case: Path, tmp_path: Path) -> None:
    stiffness = np.array([[2.0, -1.0], [-1.0, 1.0]])
    np.savez(tmp_path / "bar.npz", M=np.eye(2), K=stiffness, part_bar_stiffness=stiffness, part_bar_mass=np.eye(2))
    own = tmp_path / "bar.toml"
    own.write_text(
        'schema = 2\n[plugins]\nfiles = ["part_modulus.py"]\n[structure]\nkind = "plain"\nfile = "bar.npz"\n'
        '[[added]]\neffect = "modulus of bar"\nmodulus_ratio = 1.1\n',
        encoding="utf-8",
    )
    np.testing.assert_allclose(read_case(own).model.system.stiffness, 1.1 * stiffness, rtol=1e-14)
